#include "drivers/recording/tsv_recording.hpp"
#include "drivers/transport/file.hpp"

namespace embody::recording {

Result<Recording> load_tsv(const std::string& path) {
  const auto text = transport::load_text(path, kMaxTsvBytes, "a QTM motion export (.tsv)");
  if (!text) return text.error();
  return parse_tsv(*text, path);
}

Status save_tsv(const Recording& recording, const std::string& path) {
  const auto text = format_tsv(recording);
  if (!text) return text.error();
  return transport::save_text(*text, path, true);
}

}  // namespace embody::recording
