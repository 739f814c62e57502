#pragma once
// One flat JSON object, read name by name; what is left over is an error. Internal to the reader.
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>

#include "core/base/result.hpp"

namespace embody::capture {

/// After the first failure the getters return defaults and error() stays.
class JsonLine {
 public:
  explicit JsonLine(std::string_view text);

  /// A whole number from `least` to `most`.
  std::int64_t integer(const char* name, std::int64_t least, std::int64_t most);
  /// A text of at most `most_bytes`.
  std::string text(const char* name, std::size_t most_bytes);
  /// Which of `choices` the text is.
  std::size_t choice(const char* name, std::span<const char* const> choices);
  /// Fails when a name was not asked for.
  void end();

  [[nodiscard]] const Status& status() const noexcept { return status_; }

 private:
  const nlohmann::json* find(const char* name);

  nlohmann::json object_;
  std::size_t taken_{0};
  Status status_;
};

}  // namespace embody::capture
