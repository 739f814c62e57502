#pragma once
// Two computers on a network of their own, without rights over the real one: two network namespaces with a bridge
// between them, for tests of links that break.
//
//   here:  br0 10.199.0.1 --- v0 ) veth ( v1 10.199.0.2  :far
//            '---- w0 ) veth ( w1      (a second port: the bridge keeps its carrier when v0 leaves)
#include <fcntl.h>
#include <sched.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string>

#include "drivers/transport/unique_fd.hpp"

namespace embody::test {

class PrivateNetwork {
 public:
  static constexpr const char* kFarAddress = "10.199.0.2";

  /// The whole process moves there. @pre it has one thread.
  PrivateNetwork() {
    const auto uid = ::getuid(), gid = ::getgid();
    const bool is_root = ::geteuid() == 0;
    if (::unshare(is_root ? CLONE_NEWNET : CLONE_NEWUSER | CLONE_NEWNET) != 0) {
      why_not_ = std::string("unshare: ") + std::strerror(errno);
      return;
    }
    if (!is_root) {
      std::ofstream("/proc/self/setgroups") << "deny";
      std::ofstream("/proc/self/uid_map") << "0 " << uid << " 1";
      std::ofstream("/proc/self/gid_map") << "0 " << gid << " 1";
    }
    here_ = open_namespace();
    if (::unshare(CLONE_NEWNET) != 0) {
      why_not_ = std::string("unshare: ") + std::strerror(errno);
      return;
    }
    far_ = open_namespace();
    enter(here_);
    run("ip link set lo up");
    run("ip link add v0 type veth peer name v1");
    move_adapter(far_);
    run("ip link add w0 type veth peer name w1");
    run("ip link add br0 type bridge");
    run("ip link set br0 address 02:00:00:00:00:01");  // not v0's, which would be heard without the bridge
    for (const char* port : {"v0", "w0", "w1"}) run(std::string("ip link set ") + port + " up");
    for (const char* port : {"v0", "w0"}) run(std::string("ip link set ") + port + " master br0");
    run("ip addr add 10.199.0.1/24 dev br0");
    run("ip link set br0 up");
    at_far_end([this] { set_up_far_end(); });
  }

  /// Empty: the network is there.
  [[nodiscard]] const std::string& why_not() const noexcept { return why_not_; }

  /// What `act` opens, and the threads that it starts, are on the far computer.
  template <class Act>
  void at_far_end(Act act) {
    enter(far_);
    act();
    enter(here_);
  }

  /// Another computer with the same address takes its place, which knows nothing of its connections; what runs there
  /// runs on without a network.
  void replace_far_end() {
    enter(far_);
    if (::unshare(CLONE_NEWNET) != 0) why_not_ = std::string("unshare: ") + std::strerror(errno);
    transport::UniqueFd next = open_namespace();
    enter(far_);
    move_adapter(next);
    far_ = std::move(next);
    at_far_end([this] { set_up_far_end(); });
  }

  /// Packets of both directions vanish; nobody is told. The carrier stays.
  void lose_packets() { run("ip link set v0 nomaster"); }
  /// This computer's network adapter loses its carrier.
  void pull_cable() {
    run("ip link set v0 down");
    run("ip link set w0 down");
  }
  void mend() {
    run("ip link set v0 up");
    run("ip link set w0 up");
    run("ip link set v0 master br0");
  }

 private:
  static transport::UniqueFd open_namespace() {
    return transport::UniqueFd(::open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC));
  }
  void move_adapter(const transport::UniqueFd& to) {
    run("ip link set v1 netns /proc/" + std::to_string(::getpid()) + "/fd/" + std::to_string(to.get()));
  }
  void set_up_far_end() {
    run("ip link set lo up");
    run(std::string("ip addr add ") + kFarAddress + "/24 dev v1");
    run("ip link set v1 up");
  }
  void enter(const transport::UniqueFd& name_space) {
    if (::setns(name_space.get(), CLONE_NEWNET) != 0) why_not_ = std::string("setns: ") + std::strerror(errno);
  }
  void run(const std::string& command) {
    if (!why_not_.empty()) return;
    if (std::system(("PATH=$PATH:/usr/sbin:/sbin " + command + " 2>&1").c_str()) != 0) why_not_ = command + " fails";
  }

  transport::UniqueFd here_, far_;
  std::string why_not_;
};

}  // namespace embody::test
