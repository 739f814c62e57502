#include "drivers/recording/recording.hpp"

#include "core/base/names.hpp"

namespace embody::recording {

Status require_markers(const Recording& recording, const std::vector<std::string>& names) {
  const auto missing = describe_missing(names, recording.marker_names, 150);
  if (missing.empty()) return {};
  return make_error(Errc::kNotFound, "%.50s lacks the marker(s) %s; rename them or choose another glove",
                    recording.source.c_str(), missing.c_str());
}

}  // namespace embody::recording
