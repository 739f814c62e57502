#pragma once
// What the commands that work on files have in common.
#include <optional>
#include <string>

#include "daemon/app/config.hpp"

namespace embody::ctl {

/// The configuration (empty: the one that embodyd would use) with the subject of another file (empty: its own), for
/// recordings of marker gloves. The robot hand is of the subject's side. Errors: as config::load_config().
[[nodiscard]] Result<config::EmbodyConfig> offline_config(const std::string& config, const std::string& subject);

/// Before long work: kExitOk, or the exit code of what was said. `json` comes from the same run as `output`: `force` is
/// of both.
[[nodiscard]] int check_outputs(const std::string& output, const std::optional<std::string>& json, bool force);

}  // namespace embody::ctl
