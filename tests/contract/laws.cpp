#include "tests/contract/laws.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <thread>

#include "drivers/transport/clock.hpp"
#include "tests/support/heap_counter.hpp"

namespace embody::test {

std::vector<std::byte> rubbish(std::mt19937& random, std::size_t most) {
  std::vector<std::byte> bytes(1 + random() % most);
  for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
  return bytes;
}

std::string unique_path(const std::string& name) {
  static int number = 0;
  return ::testing::TempDir() + "embody_contract_" + name + "_" + std::to_string(::getpid()) + "_" +
         std::to_string(number++);
}

bool eventually(const std::function<bool()>& done, Duration limit) {
  const TimePoint deadline = transport::now() + limit;
  while (!done()) {
    if (transport::now() >= deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));  // leaves the processor to the device
  }
  return true;
}

void expect_sentence(std::string_view text) {
  EXPECT_GE(text.size(), 15U) << "'" << text << "'";
  EXPECT_GE(std::count(text.begin(), text.end(), ' '), 2) << "'" << text << "'";
  EXPECT_TRUE(std::none_of(text.begin(), text.end(), [](char c) { return c >= 0 && c < ' '; })) << "'" << text << "'";
}

Effort effort_of(const std::function<void()>& calls) {
  const std::uint64_t before = heap_allocations();
  const TimePoint start = transport::now();
  calls();
  const Duration time = transport::now() - start;
  return {time, heap_allocations() - before};
}

void expect_recovery(const std::function<Status()>& connect) {
  const Status first = connect();
  if (first.ok()) return;
  std::printf("second try to connect, after: %s\n", first.error().detail.c_str());
  const Status second = connect();
  ASSERT_TRUE(second.ok()) << second.error().detail.view();
}

void expect_absent(const std::function<Status()>& connect) {
  const TimePoint start = transport::now();
  const Status connected = connect();
  EXPECT_LE(to_seconds(transport::now() - start), to_seconds(kLongestConnect));
  ASSERT_FALSE(connected.ok());
  expect_sentence(connected.error().detail.view());
}

}  // namespace embody::test
