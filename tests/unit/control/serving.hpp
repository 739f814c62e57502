#pragma once
// A private folder, and a control server that runs by itself, for tests of clients.
#include <poll.h>
#include <stdlib.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <thread>

#include "daemon/control/control_server.hpp"
#include "drivers/transport/unique_fd.hpp"

namespace embody::control::test {

class TemporaryFolder {
 public:
  TemporaryFolder() {
    char name[] = "/tmp/embody-test-XXXXXX";
    path_ = ::mkdtemp(name);
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// Serves on its own thread until destroyed.
class ServingThread {
 public:
  ServingThread(const std::string& path, ControlServer::Handler handler) : end_(::eventfd(0, EFD_CLOEXEC)) {
    auto server = ControlServer::open({path, false}, std::move(handler));
    if (!server.ok()) throw std::runtime_error(std::string(server.error().detail.view()));
    server_ = std::move(server).value();
    thread_ = std::thread([this] { run(); });
  }
  ~ServingThread() {
    const std::uint64_t one = 1;
    (void)!::write(end_.get(), &one, sizeof one);
    thread_.join();
  }

 private:
  void run() {
    pollfd entries[2] = {{server_->fd(), POLLIN, 0}, {end_.get(), POLLIN, 0}};
    while (::poll(entries, 2, -1) >= 0 && entries[1].revents == 0) server_->serve();
  }

  transport::UniqueFd end_;
  std::unique_ptr<ControlServer> server_;
  std::thread thread_;
};

}  // namespace embody::control::test
