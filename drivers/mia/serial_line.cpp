#include "drivers/mia/serial_line.hpp"

#include <array>
#include <utility>

#include "drivers/transport/tty.hpp"

namespace embody::mia {
namespace {

class SerialLine final : public HandLine {
 public:
  explicit SerialLine(transport::UniqueFd fd) : fd_(std::move(fd)) {}

  [[nodiscard]] int fd() const noexcept override { return fd_.get(); }

  IoStatus send(const Command& command) noexcept override {
    return transport::write_tty(fd_.get(), std::as_bytes(std::span(command)));
  }

  IoStatus receive(std::string_view& line) noexcept override {
    while (true) {
      while (taken_ < size_) {
        if (!lines_.push(static_cast<char>(buffer_[taken_++]))) continue;
        line = lines_.line();
        return IoStatus::kDone;
      }
      const auto [status, size] = transport::read_tty(fd_.get(), buffer_);
      taken_ = 0;
      size_ = status == IoStatus::kDone ? size : 0;
      if (status != IoStatus::kDone) return status;
    }
  }

 private:
  transport::UniqueFd fd_;
  LineAssembler lines_;
  std::array<std::byte, 256> buffer_{};
  std::size_t taken_{0}, size_{0};
};

}  // namespace

OpenLine serial_line(std::string device) {
  return [device = std::move(device)]() -> Result<std::unique_ptr<HandLine>> {
    auto tty = transport::open_tty(device);
    if (!tty) return tty.error();
    return std::unique_ptr<HandLine>(std::make_unique<SerialLine>(std::move(tty->fd)));
  };
}

}  // namespace embody::mia
