#include "daemon/app/config_file.hpp"

#include <cstdlib>

#include "daemon/app/config_io.hpp"
#include "drivers/transport/file.hpp"

namespace embody::config {
namespace fs = std::filesystem;

namespace {

bool is_there(const fs::path& path) noexcept {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

/// Folder of this program, without its last component's links.
fs::path program_folder() {
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  return error ? fs::path() : self.parent_path();
}

}  // namespace

std::string shorten_path(const std::string& path) {
  constexpr std::size_t kLongest = 100;
  return path.size() <= kLongest ? path : "..." + path.substr(path.size() - kLongest);
}

Result<std::string> read_file(const fs::path& path) {
  return transport::load_text(path.string(), kMaxConfigBytes, "a configuration file (.toml)");
}

std::vector<fs::path> data_folders() {
  std::vector<fs::path> folders;
  const fs::path program = program_folder();
  if (!program.empty()) {
    const fs::path share = (program.parent_path() / "share/embody").lexically_normal();
    if (is_there(share)) folders.push_back(share);
  }
  if (is_there(EMBODY_SOURCE_CONFIG_DIR)) folders.emplace_back(EMBODY_SOURCE_CONFIG_DIR);
  return folders;
}

Result<fs::path> find_data_file(const std::string& name, const fs::path& folder) {
  const fs::path path(name);
  if (path.is_absolute()) {
    if (is_there(path)) return path;
    return make_error(Errc::kNotFound, "%s does not exist", shorten_path(name).c_str());
  }
  std::vector<fs::path> folders = data_folders();
  folders.insert(folders.begin(), folder);
  std::string tried;
  for (const fs::path& candidate : folders) {
    const fs::path full = (candidate / path).lexically_normal();
    if (is_there(full)) return full;
    tried += (tried.empty() ? "" : ", ") + shorten_path(candidate.empty() ? "." : candidate.string());
  }
  return make_error(Errc::kNotFound, "\"%s\" is not in %s", shorten_path(name).c_str(), tried.c_str());
}

Result<fs::path> find_config(const std::string& given) {
  const char* variable = std::getenv("EMBODY_CONFIG");
  const std::string from_environment = variable == nullptr ? "" : variable;
  const std::string& named = given.empty() ? from_environment : given;
  if (!named.empty()) {
    if (is_there(named)) return fs::path(named);
    return make_error(Errc::kNotFound, "configuration file %s (from %s) does not exist", shorten_path(named).c_str(),
                      given.empty() ? "EMBODY_CONFIG" : "--config");
  }
  std::vector<fs::path> folders = data_folders();
  folders.insert(folders.begin(), "/etc/embody");
  std::string tried;
  for (const fs::path& folder : folders) {
    if (is_there(folder / "embody.toml")) return folder / "embody.toml";
    tried += (tried.empty() ? "" : ", ") + folder.string();
  }
  return make_error(Errc::kNotFound, "no embody.toml in %s; name one with --config FILE", tried.c_str());
}

Result<EmbodyConfig> load_config(const fs::path& path) {
  const auto content = read_file(path);
  if (!content) return content.error();
  std::error_code ignored;
  const fs::path absolute = fs::absolute(path, ignored);
  return parse_config(*content, path.string(), absolute.parent_path());
}

}  // namespace embody::config
