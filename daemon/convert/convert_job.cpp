#include "daemon/convert/convert_job.hpp"

#include <algorithm>
#include <filesystem>

#include "daemon/convert/trajectory_csv.hpp"
#include "daemon/convert/trajectory_json.hpp"
#include "drivers/recording/tsv_recording.hpp"
#include "drivers/transport/file.hpp"

namespace embody::convert {
namespace {

namespace fs = std::filesystem;

bool is_folder(const std::string& path) {
  std::error_code ignored;
  return path.ends_with('/') || fs::is_directory(path, ignored);
}

bool same_file(const std::string& a, const std::string& b) {
  std::error_code ignored;
  return fs::equivalent(a, b, ignored) || fs::path(a).lexically_normal() == fs::path(b).lexically_normal();
}

Status check_jobs(const std::vector<ConvertJob>& jobs) {
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    for (std::size_t k = 0; k < jobs.size(); ++k) {
      if (k < i && jobs[k].output == jobs[i].output) {
        return make_error(Errc::kInvalidArgument, "%.80s and %.80s would both become %.60s: convert them one by one",
                          jobs[k].recording.c_str(), jobs[i].recording.c_str(), jobs[i].output.c_str());
      }
      if (!same_file(jobs[i].output, jobs[k].recording)) continue;
      return make_error(Errc::kInvalidArgument, "%.120s is a recording: choose another name for the output",
                        jobs[i].output.c_str());
    }
  }
  return {};
}

std::string write_text(const Trajectory& trajectory, TextFormat format) {
  if (format == TextFormat::kJson) return format_json(trajectory);
  return format_csv(trajectory, format == TextFormat::kCsv ? ',' : '\t');
}

Result<std::vector<Segment>> find_segments(const SegmentSource& source, const std::string& recording,
                                           const std::string& tsv) {
  Result<std::vector<Segment>> segments = std::vector<Segment>();
  std::string name = recording;
  if (source.events) {
    segments = parse_event_segments(tsv, recording);
  } else if (!source.metadata.empty()) {
    name = source.metadata;
    if (is_folder(name)) name = (fs::path(name) / fs::path(recording).stem()).string() + ".json";
    const auto text = transport::load_text(name, kMaxMetadataBytes, "the metadata of a recording (.json)");
    if (!text) return text.error();
    segments = parse_segments(*text, name, source.label_field);
  }
  if (!segments || source.label.empty()) return segments;
  return with_label(*segments, source.label, name);
}

/// The file of each trajectory.
std::vector<std::string> outputs_of(const ConvertJob& job, const std::vector<Segment>& segments) {
  if (segments.empty()) return {job.output};
  std::vector<std::string> outputs;
  outputs.reserve(segments.size());
  for (const Segment& segment : segments) {
    outputs.push_back(segment_path(job.output, outputs.size() + 1, segment.label));
  }
  return outputs;
}

}  // namespace

std::optional<TextFormat> format_of(const std::string& path) {
  const std::string extension = fs::path(path).extension().string();
  for (std::size_t i = 0; i < kTextFormatNames.size(); ++i) {
    if (extension == std::string(".") + kTextFormatNames[i]) return static_cast<TextFormat>(i);
  }
  return std::nullopt;
}

Result<std::vector<ConvertJob>> plan_jobs(const std::vector<std::string>& recordings, const std::string& output,
                                          std::optional<TextFormat> format) {
  std::vector<ConvertJob> jobs;
  const bool told = format_of(output).has_value() || format.has_value();
  if (is_folder(output) || (recordings.size() > 1 && !format_of(output))) {
    const TextFormat chosen = format.value_or(TextFormat::kCsv);
    for (const std::string& recording : recordings) {
      const std::string name =
          fs::path(recording).stem().string() + "." + kTextFormatNames[static_cast<std::size_t>(chosen)];
      jobs.push_back({recording, (fs::path(output) / name).string(), chosen});
    }
  } else if (recordings.size() > 1) {
    return make_error(Errc::kInvalidArgument, "%.120s is one file, for %zu recordings: name a folder", output.c_str(),
                      recordings.size());
  } else if (!told) {
    return make_error(Errc::kInvalidArgument, "%.120s ends neither in .csv nor in .tsv nor in .json; use --format",
                      output.c_str());
  } else {
    jobs.push_back({recordings.front(), output, format ? *format : *format_of(output)});
  }
  if (const Status distinct = check_jobs(jobs); !distinct) return distinct.error();
  return jobs;
}

std::string segment_path(const std::string& output, std::size_t number, const std::string& label) {
  constexpr std::size_t kLongest = 60;
  std::string name = label.substr(0, kLongest);
  for (char& c : name) {
    const bool plain = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
    if (!plain && c != '-' && c != '.' && c != '_') c = '_';
  }
  const fs::path path(output);
  const std::string file = path.stem().string() + "_" + std::to_string(number) + (name.empty() ? "" : "_" + name) +
                           path.extension().string();
  return (path.parent_path() / file).string();
}

Result<JobReport> run_job(const Models& models, const ConvertJob& job, const SegmentSource& segments,
                          ConversionOptions options, bool force) {
  const auto text = transport::load_text(job.recording, recording::kMaxTsvBytes, "a QTM motion export (.tsv)");
  if (!text) return text.error();
  const auto recording = recording::parse_tsv(*text, job.recording);
  if (!recording) return recording.error();
  auto found = find_segments(segments, job.recording, *text);
  if (!found) return found.error();
  options.segments = std::move(*found);

  JobReport report;
  report.outputs = outputs_of(job, options.segments);
  for (const std::string& output : report.outputs) {
    if (const Status writable = transport::check_output(output, force); !writable) return writable.error();
  }
  Result<Conversion> conversion = convert(models, *recording, options);
  if (!conversion) return conversion.error();
  for (std::size_t i = 0; i < report.outputs.size(); ++i) {
    const Trajectory& trajectory = conversion->trajectories[i];
    report.rows += trajectory.rows.size();
    const Status saved = transport::save_text(write_text(trajectory, job.format), report.outputs[i], force);
    if (!saved) return saved.error();
  }
  conversion->trajectories.clear();
  report.conversion = std::move(*conversion);
  return report;
}

}  // namespace embody::convert
