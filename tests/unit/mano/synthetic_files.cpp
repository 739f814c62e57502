#include "tests/unit/mano/synthetic_files.hpp"

#include <zip.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "tests/unit/math/random_values.hpp"

namespace embody::mano::test {
namespace {

using Eigen::Index;
using embody::test::RandomValues;

Array filled(std::vector<std::size_t> shape, RandomValues& random, double range) {
  std::size_t count = 1;
  for (const std::size_t n : shape) count *= n;
  Array array{std::move(shape), std::vector<double>(count)};
  for (double& value : array.values) value = random(-range, range);
  return array;
}

nlohmann::json nested(const Array& array, std::size_t dimension, std::size_t& next) {
  if (dimension == array.shape.size()) return array.values[next++];
  auto list = nlohmann::json::array();
  for (std::size_t i = 0; i < array.shape[dimension]; ++i) list.push_back(nested(array, dimension + 1, next));
  return list;
}

template <class T>
void append_as(std::string& bytes, double value) {
  // -1 as an unsigned integer is what MANO's root parent is.
  const T number = value < 0.0 && std::is_unsigned_v<T> ? static_cast<T>(-1) : static_cast<T>(value);
  char raw[sizeof(T)];
  std::memcpy(raw, &number, sizeof(T));
  bytes.append(raw, sizeof(T));
}

void append(std::string& bytes, double value, std::string_view descr) {
  if (descr == "<f8") return append_as<double>(bytes, value);
  if (descr == "<f4") return append_as<float>(bytes, value);
  if (descr == "<i8") return append_as<std::int64_t>(bytes, value);
  if (descr == "<i4") return append_as<std::int32_t>(bytes, value);
  if (descr == "<u8") return append_as<std::uint64_t>(bytes, value);
  if (descr == "<u4") return append_as<std::uint32_t>(bytes, value);
  throw std::invalid_argument("unknown type");
}

}  // namespace

ArrayFile synthetic_arrays(Side side, std::uint64_t seed) {
  constexpr std::array<std::size_t, 5> kTips{744, 320, 443, 554, 671};
  constexpr std::size_t kRegressed = 480;  // vertices that the regressor uses, the same number for every joint
  RandomValues random(seed);
  const hand::HandData skeleton = hand::builtin_hand(hand::Skeleton::kBoneLengths, side);
  ArrayFile file;
  Array& vertices = file.arrays["v_template"] = filled({778, 3}, random, .01);
  Array& regressor = file.arrays["J_regressor"] = Array{{16, 778}, std::vector<double>(std::size_t{16} * 778, 0.0)};
  Array& weights = file.arrays["weights"] = Array{{778, 16}, std::vector<double>(std::size_t{778} * 16, 0.0)};
  for (std::size_t v = 0; v < 778; ++v) {
    const std::size_t joint = v % 16;
    for (std::size_t c = 0; c < 3; ++c) {
      vertices.values[3 * v + c] += skeleton.joints_M(static_cast<Index>(c), static_cast<Index>(joint));
    }
    if (v < kRegressed) regressor.values[778 * joint + v] = 16.0 / static_cast<double>(kRegressed);
    double sum = 0.0;
    for (const std::size_t k : {joint, hand::parent_joint(joint), (joint + 5) % 16}) {
      weights.values[16 * v + k] += random(.1, 1.0);
    }
    for (std::size_t k = 0; k < 16; ++k) sum += weights.values[16 * v + k];
    for (std::size_t k = 0; k < 16; ++k) weights.values[16 * v + k] /= sum;
  }
  for (std::size_t f = 0; f < kFingers; ++f) {
    for (std::size_t c = 0; c < 3; ++c) {
      vertices.values[3 * kTips[f] + c] = skeleton.tips_M(static_cast<Index>(c), static_cast<Index>(f));
    }
  }
  Array& triangles = file.arrays["f"] = Array{{1538, 3}, std::vector<double>(std::size_t{1538} * 3)};
  for (std::size_t t = 0; t < 1538; ++t) {
    const auto first = static_cast<std::size_t>(random(0.0, 777.99));
    for (std::size_t corner = 0; corner < 3; ++corner) {
      triangles.values[3 * t + corner] = static_cast<double>((first + corner * 16) % 778);
    }
  }
  Array& tree = file.arrays["kintree_table"] = Array{{2, 16}, std::vector<double>(32)};
  for (std::size_t k = 0; k < 16; ++k) {
    tree.values[k] = k == 0 ? 4294967295.0 : static_cast<double>(hand::parent_joint(k));
    tree.values[16 + k] = static_cast<double>(k);
  }
  file.arrays["posedirs"] = filled({778, 3, 135}, random, .002);
  file.arrays["shapedirs"] = filled({778, 3, 10}, random, .002);
  return file;
}

ArrayFile with_sparse_regressor(ArrayFile file) {
  const Array dense = file.arrays.at("J_regressor");
  file.arrays.erase("J_regressor");
  Array data, indices, starts{{}, {0.0}};
  for (std::size_t column = 0; column < 778; ++column) {
    for (std::size_t row = 0; row < 16; ++row) {
      const double value = dense.values[778 * row + column];
      if (value == 0.0) continue;
      data.values.push_back(value);
      indices.values.push_back(static_cast<double>(row));
    }
    starts.values.push_back(static_cast<double>(data.values.size()));
  }
  for (Array* array : {&data, &indices, &starts}) array->shape = {array->values.size()};
  file.arrays["J_regressor.data"] = data;
  file.arrays["J_regressor.indices"] = indices;
  file.arrays["J_regressor.indptr"] = starts;
  return file;
}

std::string to_json(const ArrayFile& file) {
  auto object = nlohmann::json::object();
  for (const auto& [key, array] : file.arrays) {
    std::size_t next = 0;
    const std::size_t dot = key.find('.');
    auto& place = dot == std::string::npos ? object[key] : object[key.substr(0, dot)][key.substr(dot + 1)];
    place = nested(array, 0, next);
  }
  if (!file.side.empty()) object["side"] = file.side;
  return object.dump();
}

std::string npy_with_header(const std::string& header, const std::string& bytes) {
  std::string out("\x93NUMPY\x01\x00", 8);
  out += static_cast<char>(header.size() & 0xffU);
  out += static_cast<char>(header.size() >> 8U);
  return out + header + bytes;
}

std::string to_npy(const Array& array, std::string_view descr, bool fortran_order) {
  std::string shape, bytes;
  for (const std::size_t n : array.shape) shape += std::to_string(n) + ", ";
  const std::string header = "{'descr': '" + std::string(descr) +
                             "', 'fortran_order': " + (fortran_order ? "True" : "False") + ", 'shape': (" + shape +
                             "), }\n";
  std::vector<std::size_t> stride(array.shape.size(), 1);  // of memory order C
  for (std::size_t d = array.shape.size(); d-- > 1;) stride[d - 1] = stride[d] * array.shape[d];
  for (std::size_t i = 0; i < array.values.size(); ++i) {
    std::size_t from = i;
    if (fortran_order) {
      from = 0;
      std::size_t rest = i;
      for (std::size_t d = 0; d < array.shape.size(); ++d) {
        from += rest % array.shape[d] * stride[d];
        rest /= array.shape[d];
      }
    }
    append(bytes, array.values[from], descr);
  }
  return npy_with_header(header, bytes);
}

std::string to_zip(const std::vector<ZipEntry>& entries, bool compressed) {
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* target = zip_source_buffer_create(nullptr, 0, 0, &error);
  zip_t* archive = zip_open_from_source(target, ZIP_CREATE | ZIP_TRUNCATE, &error);
  if (archive == nullptr) throw std::runtime_error("zip");
  zip_source_keep(target);
  for (const auto& [name, bytes] : entries) {
    zip_source_t* source = zip_source_buffer(archive, bytes.data(), bytes.size(), 0);
    const zip_int64_t index = zip_file_add(archive, name.c_str(), source, 0);
    zip_set_file_compression(archive, static_cast<zip_uint64_t>(index), compressed ? ZIP_CM_DEFLATE : ZIP_CM_STORE, 1);
  }
  if (zip_close(archive) != 0) throw std::runtime_error("zip_close");
  zip_stat_t info;
  zip_source_stat(target, &info);
  std::string out(info.size, '\0');
  zip_source_open(target);
  zip_source_read(target, out.data(), out.size());
  zip_source_close(target);
  zip_source_free(target);
  return out;
}

std::string to_npz(const ArrayFile& file, bool compressed) {
  std::vector<ZipEntry> entries;
  for (const auto& [key, array] : file.arrays) {
    const bool whole =
        key == "f" || key == "kintree_table" || key == "J_regressor.indices" || key == "J_regressor.indptr";
    std::string name = key;
    for (char& c : name) c = c == '.' ? '_' : c;
    entries.push_back({name + ".npy", to_npy(array, whole ? "<u4" : "<f8", false)});
  }
  entries.push_back({"hands_mean.npy", "what nobody reads"});
  return to_zip(entries, compressed);
}

}  // namespace embody::mano::test
