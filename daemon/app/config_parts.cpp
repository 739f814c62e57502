// Subjects and hands without the configuration that includes them.
#include <set>

#include "daemon/app/config_file.hpp"
#include "daemon/app/config_io.hpp"
#include "daemon/app/config_part.hpp"

namespace embody::config {

namespace fs = std::filesystem;

Result<SubjectConfig> load_subject(const fs::path& path) {
  return load_part<SubjectConfig>(path);
}

Result<HandConfig> load_hand(const std::string& name) {
  const bool is_file = name.find('/') != std::string::npos || name.ends_with(".toml");
  if (is_file) return load_part<HandConfig>(name);
  std::set<std::string> shipped;
  for (const fs::path& folder : data_folders()) {
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(folder / "hands", ignored)) {
      if (entry.path().extension() != ".toml") continue;
      if (entry.path().stem() == name) return load_part<HandConfig>(entry.path());
      shipped.insert(entry.path().stem());
    }
  }
  std::string names;
  for (const std::string& hand : shipped) names += (names.empty() ? "" : ", ") + hand;
  return make_error(Errc::kNotFound, "there is no hand \"%.60s\"; shipped are %s; or name a file (.toml)", name.c_str(),
                    names.c_str());
}

}  // namespace embody::config
