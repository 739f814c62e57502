// Any text as a fault script and as a request to a lab. What is accepted keeps its promises.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "daemon/simlab/fault_script.hpp"
#include "daemon/simlab/lab_protocol.hpp"

namespace {

using namespace embody;
using namespace embody::sim;

void read_script(std::string_view text) {
  const auto check = [](std::string_view command) -> Status {
    if (command.find(' ') == std::string_view::npos && command.find('\t') == std::string_view::npos) std::abort();
    return command.starts_with("bad") ? Status(make_error(Errc::kInvalidArgument, "bad")) : Status();
  };
  const auto script = parse_script(text, "fuzz", check);
  if (!script) {
    if (!script.error().detail.view().starts_with("fuzz:")) std::abort();
    return;
  }
  if (script->size() > kMostScriptLines) std::abort();
  std::string printed;
  for (const ScriptedFault& fault : *script) {
    if (fault.at < Duration{0} || fault.line == 0 || fault.command.starts_with("bad")) std::abort();
    printed += "1 " + fault.command + "\n";
  }
  // What was accepted is accepted again: the words are those of one line.
  const auto again = parse_script(printed, "again", check);
  if (printed.size() <= kMostScriptBytes && (!again || again->size() != script->size())) std::abort();
  ScriptReader reader(*script);
  std::size_t count = 0;
  while (reader.take(Duration::max()) != nullptr) ++count;
  if (count != script->size()) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  read_script(text);
  if (const auto request = parse_lab_request(text)) {
    const auto again = parse_lab_request(format_lab_request(*request));
    if (!again || again->command != request->command || again->fault != request->fault || again->id != request->id) {
      std::abort();
    }
  }
  return 0;
}
