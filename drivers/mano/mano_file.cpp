#include "drivers/mano/mano_file.hpp"

#include <algorithm>
#include <array>
#include <filesystem>

#include "drivers/transport/file.hpp"

namespace embody::mano {
namespace {

bool starts_with_any(std::string_view bytes, const auto& beginnings) {
  return std::any_of(beginnings.begin(), beginnings.end(),
                     [bytes](std::string_view begin) { return bytes.substr(0, begin.size()) == begin; });
}

bool is_pickle(std::string_view bytes) {
  if (bytes.size() > 2 && bytes[0] == '\x80' && bytes[1] >= 2 && bytes[1] <= 5) return true;
  constexpr std::array<std::string_view, 5> kText{"(dp", "(lp", "(i", "cnumpy", "ccopy_reg"};  // protocols 0 and 1
  return starts_with_any(bytes, kText) || bytes.substr(0, 2) == "}q";
}

Error prefixed(const std::string& path, const Error& error) {
  const std::string text(error.detail.view());
  const std::size_t cut = path.size() > 80 ? path.size() - 80 : 0;  // the end of a path tells more
  return make_error(error.code, "%s%s: %s", cut > 0 ? "..." : "", path.c_str() + cut, text.c_str());
}

}  // namespace

Result<ManoModel> parse_model(std::string_view bytes) {
  constexpr std::array<std::string_view, 2> kZip{"PK\x03\x04", "PK\x05\x06"};
  if (is_pickle(bytes)) {
    return make_error(Errc::kUnsupported,
                      "this is a Python pickle; convert it first: scripts/mano-pickle-to-npz FILE.pkl FILE.npz");
  }
  const std::size_t text = bytes.find_first_not_of(" \t\r\n");
  const bool zip = starts_with_any(bytes, kZip);
  if (!zip && (text == std::string_view::npos || bytes[text] != '{')) {
    return make_error(Errc::kMalformed, "neither JSON nor .npz; expected a MANO model in one of these");
  }
  const auto file = zip ? read_npz(bytes) : read_json(bytes);
  if (!file) return file.error();
  return make_model(*file);
}

Result<ManoModel> load_model(const std::string& path) {
  const auto bytes = transport::load_text(path, kMaxFileBytes, "a MANO model (.json or .npz)");
  if (!bytes) return bytes.error();
  auto model = parse_model(*bytes);
  if (!model) return prefixed(path, model.error());
  return model;
}

Result<hand::HandData> load_hand(const std::string& path) {
  const auto model = load_model(path);
  if (!model) return model.error();
  return hand_data(*model, path);
}

Status save_model(const ManoModel& model, const std::string& path, bool overwrite) {
  namespace fs = std::filesystem;
  std::error_code failed;
  const fs::path folder = fs::path(path).parent_path();
  if (!folder.empty()) fs::create_directories(folder, failed);
  if (failed)
    return make_error(failed == std::errc::permission_denied ? Errc::kPermission : Errc::kIo,
                      "cannot create the folder of '%.150s': %s", path.c_str(), failed.message().c_str());
  return transport::save_text(format_model(model), path, overwrite);
}

}  // namespace embody::mano
