#pragma once
// From files to files: which outputs a conversion writes, and the whole of one recording.
#include <string>
#include <vector>

#include "daemon/convert/conversion.hpp"

namespace embody::convert {

enum class TextFormat { kCsv, kTsv, kJson };
inline constexpr std::array<const char*, 3> kTextFormatNames{"csv", "tsv", "json"};

/// Format that the name's extension tells.
[[nodiscard]] std::optional<TextFormat> format_of(const std::string& path);

/// One recording and the file that its trajectory goes to.
struct ConvertJob {
  std::string recording;
  std::string output;
  TextFormat format{TextFormat::kCsv};
};

/// `output` is a file for one recording, or a folder (which exists, or ends in '/', or is for several recordings) that
/// gets one file per recording with its name. `format`: of files whose name does not tell; csv by default in folders.
/// Errors: kInvalidArgument (a format that nothing tells, a file for several recordings, two recordings with the same
/// name, an output that is a recording).
[[nodiscard]] Result<std::vector<ConvertJob>> plan_jobs(const std::vector<std::string>& recordings,
                                                        const std::string& output, std::optional<TextFormat> format);

/// Name of the file of segment `number` (from 1): out.csv becomes out_3_grasp.csv. Characters of the label other than
/// letters, digits, '-', '.' and '_' become '_'.
[[nodiscard]] std::string segment_path(const std::string& output, std::size_t number, const std::string& label);

/// Where segments come from.
struct SegmentSource {
  std::string metadata;  ///< JSON file, or a folder with <recording>.json for each; empty: none
  bool events{false};    ///< EVENT lines of the recording
  std::string label;     ///< only these; empty: all
  int label_field{1};
};

struct JobReport {
  std::vector<std::string> outputs;
  std::size_t rows{0};
  Conversion conversion;  ///< without its trajectories
};

/// Reads, converts and writes one recording; replaces files only with `force`. Nothing is written unless everything
/// could be computed. Errors: those of reading, convert() and writing.
[[nodiscard]] Result<JobReport> run_job(const Models& models, const ConvertJob& job, const SegmentSource& segments,
                                        ConversionOptions options, bool force);

}  // namespace embody::convert
