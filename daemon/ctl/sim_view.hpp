#pragma once
// What a simulated lab tells about itself, for people. Pure functions over text.
#include <string>

namespace embody::ctl {

/// Tables of the answers of a lab (docs/simulated_lab.md), as JSON text; members that are missing are passed over.
[[nodiscard]] std::string lab_status_text(const std::string& status);
[[nodiscard]] std::string lab_report_text(const std::string& report);
[[nodiscard]] std::string lab_faults_text(const std::string& faults);

}  // namespace embody::ctl
