#include "daemon/simlab/lab_desk.hpp"

#include <nlohmann/json.hpp>
#include <utility>

namespace embody::sim {
namespace {

using control::Response;
using nlohmann::json;

/// A fault that the simulator refuses at this moment is refused; words that it does not know have failed.
Response refusal_of(const Error& error) {
  const char* code = error.code == Errc::kRefused ? control::code::kRefused : control::code::kFailed;
  return control::refusal(code, std::string(error.detail.view()));
}

std::string faults_json(const Lab& lab) {
  json faults = json::array();
  for (const auto& [device, words, meaning] : lab.fault_help()) {
    faults.push_back({{"device", device}, {"fault", words}, {"meaning", meaning}});
  }
  return json{{"faults", faults}}.dump();
}

Response respond(Lab& lab, const LabRequest& request, const std::function<void(const std::string&)>& on_fault) {
  switch (request.command) {
    case LabCommand::kStatus:
      return {true, lab.status_json(), "", ""};
    case LabCommand::kReport:
      return {true, lab.report_json(), "", ""};
    case LabCommand::kFaults:
      return {true, faults_json(lab), "", ""};
    case LabCommand::kPlay:
      lab.play();
      return {};
    case LabCommand::kFault:
      break;
  }
  if (const Status made = lab.fault(request.fault); !made) return refusal_of(made.error());
  on_fault(request.fault);
  return {true, json{{"fault", request.fault}}.dump(), "", ""};
}

}  // namespace

control::ControlServer::LineHandler make_lab_desk(Lab& lab, std::function<void(const std::string&)> on_fault) {
  return [&lab, on_fault = std::move(on_fault)](std::string_view line) {
    const auto request = parse_lab_request(line);
    if (request) return control::format_response(respond(lab, *request, on_fault), request->id);
    const bool version = request.error().code == Errc::kUnsupported;
    return control::format_response(
        control::refusal(version ? control::code::kProtocolVersion : control::code::kMalformed,
                         std::string(request.error().detail.view())),
        {});
  };
}

Result<std::unique_ptr<control::ControlServer>> open_lab_socket(const std::string& path,
                                                                control::ControlServer::LineHandler handler) {
  control::ServerConfig config;
  config.path = path;
  config.owner = {"embody-sim", "Ctrl-C", "--socket"};
  return control::ControlServer::open_lines(config, std::move(handler));
}

}  // namespace embody::sim
