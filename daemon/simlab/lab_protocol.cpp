#include "daemon/simlab/lab_protocol.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "daemon/control/protocol.hpp"
#include "daemon/control/socket_path.hpp"

namespace embody::sim {
namespace {

using nlohmann::json;

constexpr std::array<const char*, 5> kNames{"status", "report", "faults", "fault", "play"};

Error malformed(const char* why) {
  return make_error(Errc::kMalformed, "%s", why);
}

Status read_command(const json& value, LabRequest& request) {
  const auto* known = value.is_string() ? std::find(kNames.begin(), kNames.end(), value.get<std::string>()) : nullptr;
  if (known == nullptr || known == kNames.end()) {
    return malformed("command must be one of status, report, faults, fault and play");
  }
  request.command = static_cast<LabCommand>(known - kNames.begin());
  return {};
}

Status read_fault(const json& value, LabRequest& request) {
  if (!value.is_string()) return malformed("fault must be text");
  request.fault = value.get<std::string>();
  const auto is_control = [](char c) { return (c >= 0 && c < ' ') || c == 0x7f; };
  if (request.fault.empty() || request.fault.size() > kMostFaultBytes) {
    return malformed("a fault has 1 to 400 bytes");
  }
  if (std::any_of(request.fault.begin(), request.fault.end(), is_control)) {
    return malformed("a control character is in the fault");
  }
  return {};
}

Status read_member(const std::string& key, const json& value, LabRequest& request) {
  if (key == "protocol") return {};  // has been read
  if (key == "command") return read_command(value, request);
  if (key == "fault") return read_fault(value, request);
  if (key != "id") return malformed("a request has the members protocol, command, fault and id only");
  if (!value.is_number_integer() || (value.is_number_unsigned() && value.get<std::uint64_t>() > INT64_MAX)) {
    return malformed("id must be a whole number of 64 bits");
  }
  request.id = value.get<std::int64_t>();
  return {};
}

}  // namespace

const char* to_string(LabCommand command) noexcept {
  return kNames[static_cast<std::size_t>(command)];
}

Result<LabRequest> parse_lab_request(std::string_view line) {
  if (line.size() > control::kMaxLineBytes) return malformed("a request has at most 65536 bytes");
  const json message = json::parse(line, nullptr, /*allow_exceptions=*/false);
  if (!message.is_object()) return malformed("a request is one JSON object on one line");
  if (!message.contains("protocol") || !message.contains("command")) {
    return malformed("a request has the members protocol and command");
  }
  if (message["protocol"] != kLabProtocol) {
    return make_error(Errc::kUnsupported, "this lab speaks protocol %d: use an embodyctl of the same version",
                      kLabProtocol);
  }
  LabRequest request;
  for (const auto& [key, value] : message.items()) {
    if (const Status read = read_member(key, value, request); !read) return read.error();
  }
  if ((request.command == LabCommand::kFault) == request.fault.empty()) {
    return malformed("the member fault belongs to the command fault, and to no other");
  }
  return request;
}

std::string format_lab_request(const LabRequest& request) {
  json message{{"protocol", kLabProtocol}, {"command", to_string(request.command)}};
  if (request.command == LabCommand::kFault) message["fault"] = request.fault;
  if (request.id) message["id"] = *request.id;
  return message.dump(-1, ' ', false, json::error_handler_t::replace) + "\n";
}

std::string default_lab_socket() {
  return control::personal_socket_path("sim.sock");
}

}  // namespace embody::sim
