#include "drivers/transport/can_errors.hpp"

#include <linux/can.h>
#include <linux/can/error.h>

namespace embody::transport {
namespace {

constexpr std::uint8_t kOverflow = CAN_ERR_CRTL_RX_OVERFLOW | CAN_ERR_CRTL_TX_OVERFLOW;
constexpr std::uint8_t kWarning = CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING;
constexpr std::uint8_t kPassive = CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE;

constexpr bool any(std::uint32_t value, std::uint32_t bits) noexcept {
  return (value & bits) != 0;
}

}  // namespace

CanErrors decode_can_errors(const CanErrorFrame& frame) noexcept {
  CanErrors errors;
  errors.bus_off = any(frame.classes, CAN_ERR_BUSOFF);
  errors.restarted = any(frame.classes, CAN_ERR_RESTARTED);
  errors.no_ack = any(frame.classes, CAN_ERR_ACK);
  errors.arbitration_lost = any(frame.classes, CAN_ERR_LOSTARB);
  errors.protocol = any(frame.classes, CAN_ERR_PROT | CAN_ERR_BUSERROR | CAN_ERR_TRX);
  errors.tx_timeout = any(frame.classes, CAN_ERR_TX_TIMEOUT);
  if (any(frame.classes, CAN_ERR_CRTL)) {
    const std::uint8_t controller = frame.data[1];
    errors.overflow = any(controller, kOverflow);
    errors.error_warning = any(controller, kWarning);
    errors.error_passive = any(controller, kPassive);
    errors.error_active = any(controller, CAN_ERR_CRTL_ACTIVE);
  }
  return errors;
}

CanErrorFrame encode_can_errors(const CanErrors& errors) noexcept {
  CanErrorFrame frame;
  const auto add = [&frame](bool present, std::uint32_t error_class) {
    if (present) frame.classes |= error_class;
  };
  add(errors.bus_off, CAN_ERR_BUSOFF);
  add(errors.restarted, CAN_ERR_RESTARTED);
  add(errors.no_ack, CAN_ERR_ACK);
  add(errors.arbitration_lost, CAN_ERR_LOSTARB);
  add(errors.protocol, CAN_ERR_PROT);
  add(errors.tx_timeout, CAN_ERR_TX_TIMEOUT);
  unsigned controller = 0;
  if (errors.overflow) controller |= kOverflow;
  if (errors.error_warning) controller |= kWarning;
  if (errors.error_passive) controller |= kPassive;
  if (errors.error_active) controller |= CAN_ERR_CRTL_ACTIVE;
  add(controller != 0, CAN_ERR_CRTL);
  frame.data[1] = static_cast<std::uint8_t>(controller);
  return frame;
}

}  // namespace embody::transport
