#pragma once
// Hand models in MANO's format that no one ever measured: random numbers of the right shape, around a plausible
// skeleton.
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/mano/mano_model.hpp"

namespace embody::mano::test {

/// 778 vertices and 1538 triangles about the built-in skeleton; every other number random. Regressor dense.
[[nodiscard]] ArrayFile synthetic_arrays(Side side, std::uint64_t seed);

/// The regressor of `file` as compressed sparse columns instead.
[[nodiscard]] ArrayFile with_sparse_regressor(ArrayFile file);

/// As JSON. A sparse regressor becomes an object {data, indices, indptr}.
[[nodiscard]] std::string to_json(const ArrayFile& file);

/// NumPy array with the type `descr` ("<f8", "<f4", "<i4", "<i8", "<u4", "<u8").
[[nodiscard]] std::string to_npy(const Array& array, std::string_view descr, bool fortran_order);

/// NumPy array with any header text, `bytes` of data.
[[nodiscard]] std::string npy_with_header(const std::string& header, const std::string& bytes);

struct ZipEntry {
  std::string name;
  std::string bytes;
};
[[nodiscard]] std::string to_zip(const std::vector<ZipEntry>& entries, bool compressed);

/// As smplx and NumPy write it: doubles in C order, indices as unsigned 32-bit integers.
[[nodiscard]] std::string to_npz(const ArrayFile& file, bool compressed);

}  // namespace embody::mano::test
