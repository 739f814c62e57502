#include "daemon/ctl/offline.hpp"

#include "daemon/app/config_io.hpp"
#include "daemon/ctl/answer.hpp"
#include "drivers/transport/file.hpp"

namespace embody::ctl {

Result<config::EmbodyConfig> offline_config(const std::string& config, const std::string& subject) {
  const auto path = config::find_config(config);
  if (!path) return path.error();
  Result<config::EmbodyConfig> loaded = config::load_config(*path);
  if (!loaded) return loaded;
  if (!subject.empty()) {
    Result<config::SubjectConfig> other = config::load_subject(subject);
    if (!other) return other.error();
    loaded->subject = std::move(*other);
  }
  loaded->tracker.driver = config::TrackerDriver::kQualisys;
  loaded->hand.embodiment.side = loaded->subject.side;
  return loaded;
}

int check_outputs(const std::string& output, const std::optional<std::string>& json, bool force) {
  if (const Status writable = transport::check_output(output, force); !writable) return fail_file(writable.error());
  if (!json) return kExitOk;
  if (*json == output) {
    return fail(make_error(Errc::kInvalidArgument, "--json and --output name the same file"), kExitUsage);
  }
  const Status writable = transport::check_output(*json, force);
  return writable ? kExitOk : fail_file(writable.error());
}

}  // namespace embody::ctl
