#pragma once
// A value or an error, without heap and without exceptions.
#include <cstdarg>
#include <cstdio>
#include <optional>
#include <string_view>
#include <utility>

#include "core/base/fixed_string.hpp"

namespace embody {

enum class Errc {
  kInvalidArgument,  ///< the caller's value is not acceptable
  kMalformed,        ///< bytes or text that break their format
  kTruncated,        ///< more bytes are needed
  kNotFound,
  kUnsupported,
  kRefused,       ///< the peer or the present mode says no
  kTimeout,       ///< the peer did not answer in time
  kDisconnected,  ///< the peer is gone or not there
  kPermission,
  kIo,
};

/// What went wrong, as one sentence for a person: what, where, and what to do.
struct Error {
  Errc code{Errc::kIo};
  FixedString<240> detail;
};

/// Builds an Error from a printf format. Cut at 240 characters; no heap.
[[nodiscard]] __attribute__((format(printf, 2, 3))) inline Error make_error(Errc code, const char* format,
                                                                            ...) noexcept {
  char text[241];
  va_list args;
  va_start(args, format);
  std::vsnprintf(text, sizeof text, format, args);
  va_end(args);
  return {code, FixedString<240>(std::string_view(text))};
}

template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) noexcept : value_(std::move(value)) {}  // NOLINT(google-explicit-constructor)
  Result(Error error) noexcept : error_(error) {}         // NOLINT(google-explicit-constructor)

  [[nodiscard]] bool ok() const noexcept { return value_.has_value(); }
  explicit operator bool() const noexcept { return ok(); }
  /// @pre ok()
  [[nodiscard]] T& value() & noexcept { return *value_; }
  [[nodiscard]] const T& value() const& noexcept { return *value_; }
  [[nodiscard]] T&& value() && noexcept { return std::move(*value_); }
  T& operator*() noexcept { return *value_; }
  const T& operator*() const noexcept { return *value_; }
  T* operator->() noexcept { return &*value_; }
  const T* operator->() const noexcept { return &*value_; }
  /// @pre !ok()
  [[nodiscard]] const Error& error() const noexcept { return error_; }

 private:
  std::optional<T> value_;
  Error error_;
};

/// Success without a value, or an error.
template <>
class [[nodiscard]] Result<void> {
 public:
  Result() noexcept = default;
  Result(Error error) noexcept : failed_(true), error_(error) {}  // NOLINT(google-explicit-constructor)

  [[nodiscard]] bool ok() const noexcept { return !failed_; }
  explicit operator bool() const noexcept { return ok(); }
  [[nodiscard]] const Error& error() const noexcept { return error_; }

 private:
  bool failed_{false};
  Error error_;
};

using Status = Result<void>;

}  // namespace embody
