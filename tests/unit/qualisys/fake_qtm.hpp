#pragma once
// A peer that shakes hands like QTM and then sends exactly what a test tells it to, over TCP or UDP, in either byte
// order, whole or byte by byte.
#include <atomic>
#include <list>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "drivers/qualisys/codec.hpp"
#include "drivers/qualisys/stream_reassembler.hpp"
#include "drivers/transport/unique_fd.hpp"
#include "tests/unit/qualisys/wire.hpp"

namespace embody::test {

struct FakeQtmSettings {
  ByteOrder order{ByteOrder::kLittle};
  int newest_minor{28};  ///< accepts versions 1.8 to this
  bool dribble{false};   ///< one send per byte
  std::vector<std::string> labels;
  std::string bodies_xml;  ///< inside of The_6D
  std::string axis{"+Z"};
  std::string calibration_time{"2021-08-26 14:02:11"};
  double rate_hz{100.0};
  std::string processing{"<Tracking>3D</Tracking><AIM>true</AIM><Track6DOF>true</Track6DOF>"};
  unsigned state{1};
  bool answers{true};  ///< false: takes commands and says nothing
};

/// All functions from any thread.
class FakeQtm {
 public:
  explicit FakeQtm(FakeQtmSettings settings);
  FakeQtm(const FakeQtm&) = delete;
  FakeQtm& operator=(const FakeQtm&) = delete;
  ~FakeQtm();

  [[nodiscard]] std::uint16_t port() const noexcept { return port_; }
  /// Changes what is answered from now on.
  template <class Change>
  void change(Change change) {
    const std::lock_guard lock(mutex_);
    change(settings_);
  }
  /// Somebody has asked for frames.
  [[nodiscard]] bool streaming() const;
  [[nodiscard]] std::vector<std::string> commands() const;
  /// Sends to whoever streams: over TCP whatever was asked for.
  void push(const Bytes& bytes);
  /// One datagram to where StreamFrames wants them, from `address`.
  void push_datagram(const Bytes& bytes, const std::string& address = "127.0.0.1");
  /// Data the way it was asked for.
  void push_frame(const WireFrame& frame);

 private:
  struct Client {
    transport::UniqueFd fd;
    qualisys::StreamReassembler input;
    bool open{true};
    bool streams{false};
    std::uint16_t udp_port{0};
  };
  void run();
  void answer(Client& client, const std::string& command);
  void send(Client& client, const Bytes& bytes);
  [[nodiscard]] std::string parameters() const;

  mutable std::mutex mutex_;
  FakeQtmSettings settings_;
  std::list<Client> clients_;
  std::vector<std::string> commands_;
  transport::UniqueFd listener_;
  transport::UniqueFd stop_;
  std::uint16_t port_{0};
  std::thread thread_;
};

}  // namespace embody::test
