#include "drivers/sim/ur/rtde_session.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <cmath>

#include "drivers/transport/tcp.hpp"

namespace embody::sim {
namespace {

using rtde::PackageType;

constexpr std::size_t kMaxRecipeVariables = 512;
constexpr std::size_t kMaxInputRecipes = 255;

/// One package each floor(control rate / wanted rate) control cycles.
std::uint64_t divider(double control_hz, double wanted_hz) noexcept {
  constexpr double kMost = 1e9;  // a tiny rate must not leave the range of an integer
  return static_cast<std::uint64_t>(std::clamp(std::floor(control_hz / wanted_hz), 1.0, kMost));
}

}  // namespace

RtdeSession::RtdeSession(RtdeShared& shared, transport::UniqueFd fd, std::uint64_t id, TimePoint expires)
    : shared_(shared), fd_(std::move(fd)), id_(id), expires_(expires) {}

RtdeSession::~RtdeSession() {
  std::replace(shared_.owners.begin(), shared_.owners.end(), id_, std::uint64_t{0});
}

void RtdeSession::reset_on_close() noexcept {
  const linger at_once{1, 0};
  ::setsockopt(fd_.get(), SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
}

bool RtdeSession::receive() {
  constexpr int kReceives = 4;
  if (shared_.now >= expires_ || !outbox_.pump(fd_.get(), shared_.link, shared_.now)) return false;
  for (int i = 0; i < kReceives; ++i) {
    const auto received = transport::receive(fd_.get(), buffer_.space());
    if (received.status == IoStatus::kEmpty) return true;
    if (received.status == IoStatus::kDisconnected) return false;
    buffer_.commit(received.size);
    while (true) {
      const rtde::ParsedFrame parsed = buffer_.next();
      if (parsed.framing == rtde::Framing::kBroken) return false;
      if (parsed.framing == rtde::Framing::kIncomplete) break;
      if (!handle(parsed.frame)) return false;
    }
  }
  return true;
}

bool RtdeSession::publish(std::uint64_t previous, std::uint64_t cycle) {
  if (!streaming_ || previous / divider_ == cycle / divider_) return true;
  const std::size_t start = version_ == 1 ? rtde::kHeaderSize : rtde::kFieldsStart;
  package_.resize(start + outputs_.size);
  rtde::begin_data(std::span(package_), outputs_.id);
  auto next = package_.begin() + static_cast<std::ptrdiff_t>(start);
  for (const RtdeVariables::Index index : outputs_.variables) {
    const auto value = shared_.variables.bytes(index);
    next = std::copy(value.begin(), value.end(), next);
  }
  if (!send(package_)) return false;
  ++shared_.counters.packages_sent;
  return true;
}

bool RtdeSession::handle(const rtde::Frame& frame) {
  switch (static_cast<PackageType>(frame.type)) {
    case PackageType::kProtocolVersion:
      return handle_protocol(frame.payload);
    case PackageType::kControllerVersion:
      return reply(rtde::encode_controller_version(shared_.version));
    case PackageType::kText:
      return rtde::decode_text(frame.payload) ? true : complain("The text message could not be parsed");
    case PackageType::kData:
      return handle_data(frame.payload);
    case PackageType::kSetupOutputs:
      return handle_outputs(frame.payload);
    case PackageType::kSetupInputs:
      return handle_inputs(frame.payload);
    case PackageType::kStart:
      return handle_start();
    case PackageType::kPause:
      streaming_ = false;
      return reply(rtde::encode_accepted(PackageType::kPause, true));
  }
  return complain("Unknown package type " + std::to_string(frame.type));
}

bool RtdeSession::handle_protocol(rtde::Bytes payload) {
  const auto version = rtde::decode_protocol_request(payload);
  const bool accepted = version && (*version == 1 || *version == 2) && !streaming_;
  if (accepted) version_ = *version;
  return reply(rtde::encode_accepted(PackageType::kProtocolVersion, accepted));
}

bool RtdeSession::handle_outputs(rtde::Bytes payload) {
  std::optional<rtde::OutputsRequest> request{{shared_.frequency_hz, rtde::as_text(payload)}};
  if (version_ != 1) request = rtde::decode_outputs_request(payload);
  const bool usable = request && std::isfinite(request->frequency_hz) && request->frequency_hz > 0.0;
  if (!usable || streaming_) {
    return complain(streaming_ ? "Pause before setting up outputs" : "The output frequency is not usable") &&
           reply_outputs(0, {});
  }
  Resolved resolved = resolve(request->names, false);
  outputs_ = {};
  if (resolved.valid) {
    outputs_ = std::move(resolved.recipe);
    outputs_.id = 1;
    divider_ = divider(shared_.frequency_hz, request->frequency_hz);
  }
  return reply_outputs(outputs_.id, resolved.types);
}

bool RtdeSession::handle_inputs(rtde::Bytes payload) {
  if (streaming_ || inputs_.size() == kMaxInputRecipes) {
    return complain(streaming_ ? "Pause before setting up inputs" : "Too many input recipes") &&
           reply(rtde::encode_setup_reply(PackageType::kSetupInputs, {}));
  }
  Resolved resolved = resolve(rtde::as_text(payload), true);
  std::uint8_t id = 0;
  if (resolved.valid) {
    id = resolved.recipe.id = static_cast<std::uint8_t>(inputs_.size() + 1);
    for (const RtdeVariables::Index index : resolved.recipe.variables) shared_.owners[index] = id_;
    inputs_.push_back(std::move(resolved.recipe));
  }
  return reply(rtde::encode_setup_reply(PackageType::kSetupInputs, {id, resolved.types}));
}

bool RtdeSession::handle_start() {
  streaming_ = outputs_.id != 0;
  return reply(rtde::encode_accepted(PackageType::kStart, streaming_));
}

bool RtdeSession::handle_data(rtde::Bytes payload) {
  const std::size_t id = payload.empty() ? 0 : rtde::load<std::uint8_t>(payload, 0);
  if (id == 0 || id > inputs_.size()) return complain("Unknown input recipe " + std::to_string(id));
  const Recipe& recipe = inputs_[id - 1];
  const auto fields = rtde::decode_data(payload, recipe.id, recipe.size);
  if (!fields) return complain("Input recipe " + std::to_string(id) + " has another size");
  const auto sequence = shared_.variables.find("input_int_register_24");
  auto next = fields->begin();
  bool has_sequence = false;
  for (const RtdeVariables::Index index : recipe.variables) {
    const auto value = shared_.variables.bytes(index);
    std::copy_n(next, value.size(), value.begin());
    next += static_cast<std::ptrdiff_t>(value.size());
    has_sequence = has_sequence || index == sequence;
  }
  ++inputs_written_;
  ++shared_.counters.command_packages;
  if (has_sequence) count_sequence(shared_.variables.get<std::uint32_t>(*sequence));
  return true;
}

RtdeSession::Resolved RtdeSession::resolve(std::string_view names, bool inputs) const {
  Resolved resolved;
  std::string_view name;
  while (rtde::next_token(names, name) && resolved.recipe.variables.size() < kMaxRecipeVariables) {
    const auto index = shared_.variables.find(name);
    const std::string_view problem = check_variable(name, index, inputs);
    if (!resolved.types.empty()) resolved.types += ',';
    resolved.types += problem.empty() ? rtde::type_name(shared_.variables.type(*index)) : problem;
    resolved.valid = resolved.valid && problem.empty();
    resolved.recipe.variables.push_back(index.value_or(0));
    if (problem.empty()) resolved.recipe.size += rtde::wire_size(shared_.variables.type(*index));
  }
  resolved.valid = resolved.valid && names.empty() && !resolved.recipe.variables.empty();
  return resolved;
}

std::string_view RtdeSession::check_variable(std::string_view name, std::optional<RtdeVariables::Index> index,
                                             bool inputs) const {
  const bool known = index && !shared_.missing.contains(name) &&
                     (inputs ? shared_.variables.writable(*index) : shared_.variables.readable(*index));
  if (!known) return "NOT_FOUND";
  const bool mine = shared_.owners[*index] == 0 || shared_.owners[*index] == id_;
  return !inputs || (mine && shared_.now >= shared_.in_use_until) ? "" : "IN_USE";
}

bool RtdeSession::reply_outputs(std::uint8_t id, std::string_view types) {
  if (version_ == 1) return reply(rtde::encode_outputs_reply_v1(types));
  return reply(rtde::encode_setup_reply(PackageType::kSetupOutputs, {id, types}));
}

void RtdeSession::count_sequence(std::uint32_t sequence) noexcept {
  constexpr std::uint32_t kMask = 0x7FFF'FFFF;
  constexpr std::uint32_t kBackwards = 0x4000'0000;
  RtdeCounters& counters = shared_.counters;
  const std::uint32_t step = (sequence - last_sequence_) & kMask;
  if (sequences_ >= 2 && step == 0) ++counters.sequence_duplicates;
  if (sequences_ >= 2 && step > 1) {
    ++counters.sequence_gaps;
    if (step < kBackwards) counters.max_missing = std::max<std::uint64_t>(counters.max_missing, step - 1);
  }
  last_sequence_ = sequence;
  ++sequences_;
}

bool RtdeSession::complain(std::string_view message) {
  ++shared_.counters.bad_packages;
  const rtde::Text text{message, "RTDE", static_cast<std::uint8_t>(rtde::TextLevel::kError)};
  return send(version_ == 1 ? rtde::encode_text_v1(text) : rtde::encode_text(text));
}

bool RtdeSession::reply(rtde::Bytes package) {
  if (!shared_.texts_in_handshake) return send(package);
  const rtde::Text text{"Arm is not powered", "Controller", static_cast<std::uint8_t>(rtde::TextLevel::kInfo)};
  return send(version_ == 1 ? rtde::encode_text_v1(text) : rtde::encode_text(text)) && send(package);
}

bool RtdeSession::send(rtde::Bytes package) {
  if (outbox_.send(fd_.get(), package, shared_.link, shared_.now)) return true;
  // A full buffer, or a package that fits it in part only: the client does not keep up, and is dropped.
  ++shared_.counters.slow_clients_closed;
  return false;
}

}  // namespace embody::sim
