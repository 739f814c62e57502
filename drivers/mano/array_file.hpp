#pragma once
// Named arrays of numbers: what every container of a MANO model boils down to.
#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.hpp"

namespace embody::mano {

inline constexpr std::size_t kMaxFileBytes = std::size_t{256} << 20;
/// Most numbers that are kept of one file. A complete model has 0.4 million.
inline constexpr std::size_t kMaxNumbers = 2'000'000;
inline constexpr std::size_t kMaxDimensions = 3;

struct Array {
  std::vector<std::size_t> shape;
  std::vector<double> values;  ///< last index fastest
};

struct ArrayFile {
  std::map<std::string, Array, std::less<>> arrays;
  std::string side;  ///< "left", "right" or nothing
};

/// Arrays that a hand model is made of; others are skipped unread. The parts of a sparse (CSC) joint regressor are
/// named J_regressor.data, J_regressor.indices and J_regressor.indptr.
[[nodiscard]] bool is_wanted(std::string_view key) noexcept;

/// "778x3"; "a single number" for no dimension.
[[nodiscard]] std::string shape_text(const std::vector<std::size_t>& shape);

/// A file of NumPy's savez or savez_compressed. Only wanted entries are unpacked, and none that says it is larger than
/// kMaxNumbers can be. Errors: kMalformed, kUnsupported; they name the array.
[[nodiscard]] Result<ArrayFile> read_npz(std::string_view bytes);

/// One array in NumPy's format (NEP 1, versions 1 to 3): little-endian f4 f8 i4 i8 u4 u8, at most three dimensions, in
/// C or Fortran order. `key` is for messages. Errors: kMalformed, kUnsupported (also more than `max_numbers`).
[[nodiscard]] Result<Array> parse_npy(std::string_view bytes, std::string_view key, std::size_t max_numbers);

/// A JSON object of nested lists; J_regressor may be an object {data, indices, indptr}. Never holds more than
/// kMaxNumbers numbers. Errors: kMalformed, kUnsupported.
[[nodiscard]] Result<ArrayFile> read_json(std::string_view text);

}  // namespace embody::mano
