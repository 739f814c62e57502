// The control socket over real sockets. Most tests serve by hand, so that every step is where the test says.
#include "daemon/control/control_server.hpp"

#include <grp.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "daemon/control/control_client.hpp"
#include "tests/unit/control/serving.hpp"

namespace embody::control {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::TemporaryFolder;
using transport::UniqueFd;

const std::string kStop = "{\"protocol\":1,\"command\":\"stop\"}\n";
const std::string kStatus = "{\"protocol\":1,\"command\":\"status\"}\n";

/// A client that sends any bytes and never waits.
class RawClient {
 public:
  explicit RawClient(const std::string& path) : fd_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    connected_ = ::connect(fd_.get(), reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  }
  [[nodiscard]] bool connected() const { return connected_; }
  [[nodiscard]] int fd() const { return fd_.get(); }
  /// False when the server has closed.
  bool send(const std::string& bytes) const {
    return ::send(fd_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT) ==
           static_cast<ssize_t>(bytes.size());
  }
  /// Everything that is there now; `closed` when the server has hung up behind it.
  std::string receive() {
    std::string text(1 << 20, '\0');
    std::size_t size = 0;
    ssize_t got = 0;
    while ((got = ::recv(fd_.get(), text.data() + size, text.size() - size, MSG_DONTWAIT)) > 0) {
      size += static_cast<std::size_t>(got);
    }
    closed = got == 0 || (got < 0 && errno != EAGAIN);
    text.resize(size);
    return text;
  }
  bool closed{false};

 private:
  UniqueFd fd_;
  bool connected_{false};
};

class Server : public ::testing::Test {
 protected:
  void start(bool group_access = false) {
    auto server =
        ControlServer::open({path_, group_access}, [this](const Request& request) { return answer(request); });
    ASSERT_TRUE(server.ok()) << server.error().detail.view();
    server_ = std::move(server).value();
  }
  Response answer(const Request& request) {
    requests_.push_back(request);
    if (request.command == Command::kEngage) return refusal(code::kRefused, "not aligned");
    if (request.command == Command::kReset) throw std::runtime_error("out of order");
    return {true, result_, "", ""};
  }
  /// Serves until nothing is due.
  void serve() {
    pollfd entry{server_->fd(), POLLIN, 0};
    for (int i = 0; i < 1000 && ::poll(&entry, 1, 0) > 0; ++i) server_->serve();
  }
  std::string exchange(RawClient& client, const std::string& bytes) {
    EXPECT_TRUE(client.send(bytes));
    serve();
    return client.receive();
  }

  TemporaryFolder folder_;
  std::string path_{folder_.path() + "/run/control.sock"};
  std::string result_{"{\"n\":1}"};
  std::vector<Request> requests_;
  std::unique_ptr<ControlServer> server_;
};

TEST_F(Server, AnswersEachLineOnceAndInOrder) {
  start();
  RawClient client(path_);
  const std::string text = exchange(client,
                                    "{\"protocol\":1,\"command\":\"stop\",\"id\":1}\n"
                                    "{\"protocol\":1,\"command\":\"engage\",\"id\":2}\n"
                                    "{\"protocol\":1,\"command\":\"reset\",\"id\":3}\n");
  EXPECT_EQ(text,
            "{\"protocol\":1,\"ok\":true,\"id\":1,\"result\":{\"n\":1}}\n"
            "{\"protocol\":1,\"ok\":false,\"id\":2,\"error\":{\"code\":\"refused\",\"message\":\"not aligned\"}}\n"
            "{\"protocol\":1,\"ok\":false,\"id\":3,\"error\":{\"code\":\"failed\",\"message\":\"out of order\"}}\n");
  EXPECT_EQ(server_->counters().requests, 3u);
}

TEST_F(Server, NamesThePeerOfARequest) {
  start();
  RawClient client(path_);
  exchange(client, kStop);
  ASSERT_EQ(requests_.size(), 1u);
  EXPECT_EQ(requests_[0].peer.pid, ::getpid());
  EXPECT_EQ(requests_[0].peer.uid, ::geteuid());
}

TEST_F(Server, WaitsForTheEndOfALineThatComesInPieces) {
  start();
  RawClient client(path_);
  for (std::size_t i = 0; i + 1 < kStop.size(); ++i) {
    ASSERT_EQ(exchange(client, kStop.substr(i, 1)), "");
  }
  EXPECT_TRUE(requests_.empty());
  EXPECT_NE(exchange(client, "\n").find("\"ok\":true"), std::string::npos);
}

TEST_F(Server, AHalfLineAtTheEndOfAConnectionIsNoRequest) {
  start();
  {
    RawClient client(path_);
    exchange(client, kStop.substr(0, kStop.size() - 1));
  }
  serve();
  EXPECT_TRUE(requests_.empty());
  EXPECT_EQ(server_->client_count(), 0u);
}

TEST_F(Server, GarbageIsAnsweredAndTheConnectionGoesOn) {
  start();
  RawClient client(path_);
  const std::string text = exchange(client, std::string("\0\xff\x1b[\n", 5) + "GET / HTTP/1.1\r\n\r\n" + kStop);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 3) << text;
  EXPECT_NE(text.find("\"code\":\"malformed\""), std::string::npos);
  EXPECT_EQ(server_->counters().malformed, 2u);
  EXPECT_EQ(requests_.size(), 1u);
}

TEST_F(Server, AnotherProtocolVersionIsToldSo) {
  start();
  RawClient client(path_);
  EXPECT_NE(exchange(client, "{\"protocol\":9,\"command\":\"stop\"}\n").find("\"code\":\"protocol\""),
            std::string::npos);
}

TEST_F(Server, AnOverlongLineEndsItsConnectionAndNoOther) {
  start();
  RawClient good(path_), bad(path_);
  const std::string piece(8 * 1024, 'x');
  bool open = true;
  for (int i = 0; i < 40 && open; ++i) {
    open = bad.send(piece);
    serve();
  }
  EXPECT_NE(bad.receive().find("at most 65536 bytes"), std::string::npos);
  EXPECT_TRUE(bad.closed);
  EXPECT_NE(exchange(good, kStop).find("\"ok\":true"), std::string::npos);
  EXPECT_EQ(server_->counters().dropped, 1u);
}

TEST_F(Server, AClientThatDoesNotReadIsDroppedAndNoOther) {
  result_ = "{\"text\":\"" + std::string(8000, 'y') + "\"}";
  start();
  RawClient good(path_), slow(path_);
  bool open = true;
  int sent = 0;
  for (; sent < 1000 && open; ++sent) {
    open = slow.send(kStatus);
    serve();
  }
  EXPECT_LT(sent, 1000) << "256 KiB and the kernel's buffer are far less than 1000 answers of 8 KB";
  EXPECT_EQ(server_->client_count(), 1u);
  EXPECT_NE(exchange(good, kStop).find("\"ok\":true"), std::string::npos);
}

TEST_F(Server, AnAnswerLargerThanTheKernelsBufferArrivesWhole) {
  result_ = "{\"text\":\"" + std::string(200'000, 'z') + "\"}";
  start();
  RawClient client(path_);
  int small = 4096;
  ::setsockopt(client.fd(), SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
  ASSERT_TRUE(client.send(kStatus + kStop));
  std::string text;
  for (int i = 0; i < 1000 && std::count(text.begin(), text.end(), '\n') < 2; ++i) {
    serve();
    text += client.receive();
  }
  ASSERT_EQ(std::count(text.begin(), text.end(), '\n'), 2);
  EXPECT_EQ(json::parse(text.substr(0, text.find('\n')))["result"]["text"].get<std::string>().size(), 200'000u);
}

TEST_F(Server, TheSeventeenthClientIsToldThatTheDaemonIsBusyAndLaterFindsRoom) {
  start();
  std::vector<std::unique_ptr<RawClient>> clients;
  for (int i = 0; i < 16; ++i) clients.push_back(std::make_unique<RawClient>(path_));
  serve();
  RawClient extra(path_);
  serve();
  EXPECT_NE(extra.receive().find("\"code\":\"busy\""), std::string::npos);
  EXPECT_TRUE(extra.closed);
  clients.pop_back();  // and the next one comes before the server has noticed
  RawClient again(path_);
  EXPECT_NE(exchange(again, kStop).find("\"ok\":true"), std::string::npos);
}

TEST_F(Server, ASubscriptionBringsTheStatusNowAndThenPeriodically) {
  start();
  RawClient client(path_);
  std::string text = exchange(client, "{\"protocol\":1,\"command\":\"subscribe\",\"interval_ms\":20,\"id\":4}\n");
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1) << "one at once";
  const auto begin = std::chrono::steady_clock::now();
  while (std::count(text.begin(), text.end(), '\n') < 6) {
    pollfd entry{server_->fd(), POLLIN, 0};
    ASSERT_EQ(::poll(&entry, 1, 5000), 1);
    serve();
    text += client.receive();
  }
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(99));
  EXPECT_NE(text.find("\"id\":4"), std::string::npos);
  EXPECT_EQ(requests_.back().command, Command::kStatus);
  EXPECT_NE(exchange(client, kStop).find("\"ok\":true"), std::string::npos) << "requests still work";
}

TEST_F(Server, TheSocketAndItsFolderAreForTheOwnerOnly) {
  start();
  EXPECT_EQ(fs::status(path_).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_EQ(fs::status(folder_.path() + "/run").permissions(), fs::perms::owner_all);
}

TEST_F(Server, WithGroupAccessTheGroupMayUseIt) {
  const mode_t old = ::umask(0077);
  start(/*group_access=*/true);
  ::umask(old);
  EXPECT_EQ(static_cast<unsigned>(fs::status(path_).permissions()), 0660u);
}

TEST_F(Server, TheSocketFileGoesWithTheServer) {
  start();
  ASSERT_TRUE(fs::exists(path_));
  server_.reset();
  EXPECT_FALSE(fs::exists(path_));
}

TEST_F(Server, ASecondServerIsRefusedAndTheFirstGoesOn) {
  start();
  const auto second = ControlServer::open({path_, false}, [](const Request&) { return Response{}; });
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, Errc::kRefused);
  EXPECT_NE(second.error().detail.view().find("another embodyd answers"), std::string_view::npos);
  serve();
  RawClient client(path_);
  EXPECT_NE(exchange(client, kStop).find("\"ok\":true"), std::string::npos);
}

TEST_F(Server, AStaleSocketIsReplaced) {
  start();
  fs::create_directories(folder_.path() + "/elsewhere");
  const std::string kept = folder_.path() + "/elsewhere/kept.sock";
  fs::rename(path_, kept);  // the dying server does not find its file ...
  server_.reset();
  fs::rename(kept, path_);  // ... so a socket without a listener is left, as after SIGKILL
  ASSERT_EQ(ControlClient::connect(path_).error().code, Errc::kDisconnected);
  ASSERT_NO_FATAL_FAILURE(start());
  RawClient client(path_);
  EXPECT_NE(exchange(client, kStop).find("\"ok\":true"), std::string::npos);
}

TEST_F(Server, WhatIsNotASocketIsLeftAlone) {
  fs::create_directories(folder_.path() + "/run");
  std::ofstream(path_) << "precious";
  const auto server = ControlServer::open({path_, false}, [](const Request&) { return Response{}; });
  ASSERT_FALSE(server.ok());
  EXPECT_NE(server.error().detail.view().find("is no socket"), std::string_view::npos);
  EXPECT_TRUE(fs::is_regular_file(path_));
}

TEST_F(Server, APathThatCannotWorkIsRefusedWithAReason) {
  const auto handler = [](const Request&) { return Response{}; };
  EXPECT_EQ(ControlServer::open({"/tmp/" + std::string(200, 'p'), false}, handler).error().code,
            Errc::kInvalidArgument);
  EXPECT_EQ(ControlServer::open({"relative.sock", false}, handler).error().code, Errc::kInvalidArgument);
  EXPECT_FALSE(ControlServer::open({folder_.path() + "/a/b/c.sock", false}, handler).ok()) << "one level only";
}

TEST_F(Server, AFolderThatAnybodyMayWriteToIsRefused) {
  fs::create_directories(folder_.path() + "/run");
  ASSERT_EQ(::chmod((folder_.path() + "/run").c_str(), 0777), 0);
  const auto server = ControlServer::open({path_, false}, [](const Request&) { return Response{}; });
  ASSERT_FALSE(server.ok());
  EXPECT_NE(server.error().detail.view().find("anybody may write"), std::string_view::npos);
}

TEST_F(Server, AFolderOfAnotherUserIsRefused) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can give a folder to another user";
  fs::create_directories(folder_.path() + "/run");
  ASSERT_EQ(::chown((folder_.path() + "/run").c_str(), 65534, 65534), 0);
  EXPECT_FALSE(ControlServer::open({path_, false}, [](const Request&) { return Response{}; }).ok());
}

/// Exit code of a child that has become the user nobody, with group `gid`, and tried to connect: 0 connected, 1
/// permission, 2 anything else.
int connect_as_nobody(const std::string& path, gid_t gid) {
  const pid_t child = ::fork();
  if (child == 0) {
    if (::setgroups(0, nullptr) != 0 || ::setgid(gid) != 0 || ::setuid(65534) != 0) ::_exit(3);
    const auto client = ControlClient::connect(path);
    ::_exit(client.ok() ? 0 : client.error().code == Errc::kPermission ? 1 : 2);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST_F(Server, AnotherUserMayNotConnect) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can become another user";
  start();
  EXPECT_EQ(connect_as_nobody(path_, 65534), 1) << "the folder is closed";
  for (const std::string& folder : {folder_.path(), folder_.path() + "/run"}) {
    ASSERT_EQ(::chmod(folder.c_str(), 0755), 0);
  }
  EXPECT_EQ(connect_as_nobody(path_, 65534), 1) << "the socket itself is closed, too";
  EXPECT_EQ(connect_as_nobody(path_, ::getegid()), 1) << "and closed to the group";
}

TEST_F(Server, WithGroupAccessOnlyTheGroupConnects) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can become another user";
  start(/*group_access=*/true);
  for (const std::string& folder : {folder_.path(), folder_.path() + "/run"}) {
    ASSERT_EQ(::chmod(folder.c_str(), 0755), 0);
  }
  EXPECT_EQ(connect_as_nobody(path_, ::getegid()), 0);
  EXPECT_EQ(connect_as_nobody(path_, 65534), 1);
}

TEST_F(Server, TheClientSaysThatNoDaemonRuns) {
  const auto client = ControlClient::connect(path_);
  ASSERT_FALSE(client.ok());
  EXPECT_EQ(client.error().code, Errc::kDisconnected);
  EXPECT_NE(client.error().detail.view().find("embodyd is not running"), std::string_view::npos);
}

TEST_F(Server, TheClientGivesUpOnADaemonThatDoesNotAnswer) {
  start();
  auto client = ControlClient::connect(path_);
  ASSERT_TRUE(client.ok());
  const auto response = client->request({}, std::chrono::milliseconds(30));
  ASSERT_FALSE(response.ok());
  EXPECT_EQ(response.error().code, Errc::kTimeout);
}

TEST_F(Server, TheClientNoticesThatTheDaemonEnded) {
  start();
  auto client = ControlClient::connect(path_);
  ASSERT_TRUE(client.ok());
  serve();
  server_.reset();
  const auto response = client->request({}, std::chrono::seconds(5));
  ASSERT_FALSE(response.ok());
  EXPECT_EQ(response.error().code, Errc::kDisconnected);
}

TEST_F(Server, TheClientExchangesRequestsAndFollowsASubscription) {
  test::ServingThread serving(path_, [this](const Request& request) { return answer(request); });
  auto client = ControlClient::connect(path_);
  ASSERT_TRUE(client.ok()) << client.error().detail.view();
  Request request;
  request.command = Command::kEngage;
  const auto refused = client->request(request, std::chrono::seconds(5));
  ASSERT_TRUE(refused.ok());
  EXPECT_EQ(refused->code, "refused");
  request.command = Command::kSubscribe;
  request.interval = std::chrono::milliseconds(20);
  ASSERT_TRUE(client->request(request, std::chrono::seconds(5)).ok());
  for (int i = 0; i < 3; ++i) {
    const auto line = client->next(std::chrono::seconds(5));
    ASSERT_TRUE(line.ok()) << line.error().detail.view();
    EXPECT_EQ(line->result, "{\"n\":1}");
  }
}

}  // namespace
}  // namespace embody::control
