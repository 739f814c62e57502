#include "drivers/sim/qtm/command_desk.hpp"

#include <algorithm>
#include <array>

namespace embody::sim {
namespace {

Answer text(std::string reply) {
  Answer answer;
  answer.reply = Reply{Packet::kCommand, std::move(reply)};
  return answer;
}
Answer error(std::string reply) {
  Answer answer;
  answer.reply = Reply{Packet::kError, std::move(reply)};
  return answer;
}
Answer parse_error() {
  return error("Parse error");
}
/// Before the client has chosen a version QTM speaks 1.1, whose coordinates have 64 bits: not served here.
bool speaks_data(const Conversation& client) noexcept {
  return client.minor_version >= kOldestMinorVersion;
}

bool is_control(std::string_view verb) {
  constexpr std::array<std::string_view, 9> kControl{"new",  "close", "start",       "stop",     "load",
                                                     "save", "trig",  "setqtmevent", "calibrate"};
  return verb == "loadproject" || std::find(kControl.begin(), kControl.end(), verb) != kControl.end();
}

}  // namespace

Answer CommandDesk::answer(Conversation& client, const Request& request, TimePoint now) {
  if (request.type == static_cast<std::uint32_t>(Packet::kXml)) return settings(client, request.text);
  if (request.type != static_cast<std::uint32_t>(Packet::kCommand)) return parse_error();
  return command(client, command_words(request.text), now);
}

Answer CommandDesk::command(Conversation& client, const Words& words, TimePoint now) {
  const std::string verb = words.empty() ? "" : lower_case(words[0]);
  if (verb == "version") return version(client, words);
  if (verb == "streamframes") return stream(client, words);
  if (verb == "getcurrentframe") return current_frame(client, words);
  if (verb == "getparameters") return parameters(client, words);
  if (verb == "takecontrol") return take_control(client, words);
  if (is_control(verb)) return control(client, words, now);
  if (words.size() != 1) return parse_error();
  if (verb == "qtmversion") return text("QTM Version is 2023.3 (build 13590)");
  if (verb == "byteorder") {
    return text(client.order == ByteOrder::kBig ? "Byte order is big endian" : "Byte order is little endian");
  }
  if (verb == "releasecontrol") return release_control(client);
  // GetLastEvent is its name before 1.10.
  if (verb == "getstate" || (verb == "getlastevent" && client.minor_version < 10)) {
    Answer answer;
    answer.reply = measurement_.last_state();
    return answer;
  }
  return parse_error();
}

void CommandDesk::forget(const Conversation& client) {
  if (is_master(client)) master_.reset();
}

Answer CommandDesk::version(Conversation& client, const Words& words) {
  if (words.size() == 1) return text("Version is 1." + std::to_string(client.minor_version));
  if (words.size() != 2) return parse_error();
  const auto minor = supported_minor_version(words[1]);
  if (!minor) return error("Version NOT supported");
  client.minor_version = *minor;
  return text("Version set to " + words[1]);
}

Answer CommandDesk::stream(Conversation& client, const Words& words) const {
  Answer answer;
  if (words.size() == 2 && lower_case(words[1]) == "stop") {
    client.stream.reset();
    answer.stream_changed = true;
    return answer;
  }
  if (!speaks_data(client)) return error("Version NOT supported");
  auto request = parse_stream(words, setup_.rate_hz, client.minor_version);
  if (!request) return parse_error();
  client.stream = std::move(*request);
  answer.stream_changed = true;
  return answer;
}

Answer CommandDesk::current_frame(Conversation& client, const Words& words) {
  if (!speaks_data(client)) return error("Version NOT supported");
  auto components = parse_components(words, 1, client.minor_version);
  if (!components) return parse_error();
  client.current_frame = std::move(*components);
  Answer answer;
  answer.frame_wanted = true;
  return answer;
}

Answer CommandDesk::parameters(const Conversation& client, const Words& words) const {
  auto xml = parameters_xml(words, setup_, client.minor_version);
  if (!xml) return parse_error();
  Answer answer;
  answer.parameters_asked = true;
  if (measurement_.state() == Measurement::State::kClosed) {
    answer.reply = Reply{Packet::kError, "Parameters not available"};
  } else {
    answer.reply = Reply{Packet::kXml, std::move(*xml)};
  }
  return answer;
}

Answer CommandDesk::take_control(const Conversation& client, const Words& words) {
  if (words.size() > 2) return parse_error();
  if (is_master(client)) return text("You are already master");
  if (!config_.control_enabled) return error("Client control disabled in QTM");
  if (master_) return error(master_peer_ + " is already master");
  if (!config_.password.empty() && (words.size() != 2 || words[1] != config_.password)) {
    return error("Wrong or missing password");
  }
  master_ = client.id;
  master_peer_ = client.peer;
  return text("You are now master");
}

Answer CommandDesk::release_control(const Conversation& client) {
  if (!is_master(client)) return text("You are already a regular client");
  master_.reset();
  return text("You are now a regular client");
}

Answer CommandDesk::control(const Conversation& client, const Words& words, TimePoint now) {
  if (!is_master(client)) return error("You must be master to issue this command");
  const std::string verb = lower_case(words[0]);
  auto outcome = measurement_.command(verb, words, now);
  if (!outcome) return parse_error();
  Answer answer;
  answer.calibration_asked = verb == "calibrate" && !outcome->error;
  answer.reply = Reply{outcome->error ? Packet::kError : Packet::kCommand, std::move(outcome->reply)};
  answer.events = std::move(outcome->events);
  return answer;
}

Answer CommandDesk::settings(const Conversation& client, std::string_view xml) const {
  if (!is_master(client)) return error("You must be master to issue this command");
  // Nothing that this server has can be set; it looks at the root only.
  const bool whole =
      xml.find("<QTM_Settings>") != std::string_view::npos && xml.find("</QTM_Settings>") != std::string_view::npos;
  return whole ? text("Setting parameters succeeded") : error("Setting parameters failed");
}

}  // namespace embody::sim
