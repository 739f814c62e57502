#include "daemon/control/protocol.hpp"

#include <array>
#include <nlohmann/json.hpp>

namespace embody::control {
namespace {

using nlohmann::json;                    // sorted: requests of strangers with many members stay cheap
using Ordered = nlohmann::ordered_json;  // answers of the daemon keep its order

constexpr std::array<const char*, 8> kCommands{"status", "engage",   "disengage", "stop",
                                               "reset",  "shutdown", "subscribe", "markers"};
constexpr std::int64_t kShortestIntervalMs = 20;
constexpr std::int64_t kLongestIntervalMs = 60'000;

std::string dump(const Ordered& value) {
  return value.dump(-1, ' ', false, Ordered::error_handler_t::replace);
}

/// Text of a client, made short and printable for an error message.
std::string shown(std::string_view text) {
  std::string result;
  for (const char c : text.substr(0, 40)) result += c >= 0x20 && c < 0x7f && c != '"' ? c : '?';
  return "'" + result + "'";
}

Error malformed(const std::string& why) {
  return make_error(Errc::kMalformed, "%s", why.c_str());
}

Status read_member(const std::string& key, const json& value, Request& request, bool& has_interval) {
  if (key == "protocol") {
    if (!value.is_number_integer()) return malformed("protocol must be a whole number");
    if (value != kProtocol) {
      return make_error(Errc::kUnsupported, "this daemon speaks protocol %d: use an embodyctl of the same version",
                        kProtocol);
    }
  } else if (key == "command") {
    if (!value.is_string()) return malformed("command must be text");
    const auto& name = value.get_ref<const std::string&>();
    for (std::size_t i = 0; i < kCommands.size(); ++i) {
      if (name == kCommands[i]) {
        request.command = static_cast<Command>(i);
        return {};
      }
    }
    return malformed("unknown command " + shown(name));
  } else if (key == "id") {
    if (!value.is_number_integer() || (value.is_number_unsigned() && value.get<std::uint64_t>() > INT64_MAX)) {
      return malformed("id must be a whole number of 64 bits");
    }
    request.id = value.get<std::int64_t>();
  } else if (key == "interval_ms") {
    if (!value.is_number_integer() || value < kShortestIntervalMs || value > kLongestIntervalMs) {
      return malformed("interval_ms must be a whole number from 20 to 60000");
    }
    request.interval = std::chrono::milliseconds(value.get<std::int64_t>());
    has_interval = true;
  } else {
    return malformed("unknown member " + shown(key));
  }
  return {};
}

}  // namespace

const char* to_string(Command command) noexcept {
  return kCommands[static_cast<std::size_t>(command)];
}

Result<Request> parse_request(std::string_view line) {
  if (line.size() > kMaxLineBytes) return malformed("a request has at most 65536 bytes");
  const json message = json::parse(line, nullptr, /*allow_exceptions=*/false);
  if (!message.is_object()) return malformed("a request is one JSON object on one line");
  // The version first: what else a message of another version means is not ours to judge.
  for (const char* key : {"protocol", "command"}) {
    if (!message.contains(key)) return malformed(std::string("member '") + key + "' is missing");
  }
  Request request;
  bool has_interval = false;
  if (const auto status = read_member("protocol", message["protocol"], request, has_interval); !status) {
    return status.error();
  }
  for (const auto& [key, value] : message.items()) {
    if (const auto status = read_member(key, value, request, has_interval); !status) return status.error();
  }
  if (has_interval && request.command != Command::kSubscribe) return malformed("interval_ms belongs to subscribe");
  return request;
}

std::string format_request(const Request& request) {
  Ordered message{{"protocol", kProtocol}, {"command", to_string(request.command)}};
  if (request.id) message["id"] = *request.id;
  if (request.command == Command::kSubscribe) message["interval_ms"] = request.interval.count();
  return dump(message) + "\n";
}

std::string format_response(const Response& response, const std::optional<std::int64_t>& id) {
  Ordered message{{"protocol", kProtocol}, {"ok", response.ok}};
  if (id) message["id"] = *id;
  if (response.ok) {
    Ordered result = Ordered::parse(response.result, nullptr, false);
    if (!result.is_object()) {
      return format_response(refusal(code::kFailed, "the daemon produced a result that is no JSON object"), id);
    }
    message["result"] = std::move(result);
  } else {
    message["error"] = {{"code", response.code}, {"message", response.message}};
  }
  return dump(message) + "\n";
}

Result<Response> parse_response(std::string_view line) {
  const Ordered message = Ordered::parse(line, nullptr, false);
  const auto broken = [] { return malformed("the answer of the daemon is no control message"); };
  if (!message.is_object() || !message.contains("ok") || !message["ok"].is_boolean()) return broken();
  Response response;
  response.ok = message["ok"].get<bool>();
  if (response.ok) {
    if (!message.contains("result") || !message["result"].is_object()) return broken();
    response.result = dump(message["result"]);
    return response;
  }
  const auto error = message.find("error");
  if (error == message.end() || !error->is_object()) return broken();
  const auto text = [&error](const char* key) {
    const auto member = error->find(key);
    return member != error->end() && member->is_string() ? member->get<std::string>() : std::string();
  };
  response.code = text("code");
  response.message = text("message");
  return response;
}

}  // namespace embody::control
