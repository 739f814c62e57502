// Whatever is wrong with a file: it is refused, with one sentence that names the key.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "drivers/mano/mano_file.hpp"
#include "tests/unit/mano/synthetic_files.hpp"
#include "tests/unit/math/random_values.hpp"

namespace embody::mano {
namespace {

using test::npy_with_header;
using test::synthetic_arrays;

constexpr std::uint64_t kSeed = 41;

std::string message(const auto& result) {
  return result ? "accepted" : std::string(result.error().detail.view());
}

void expect_named(const std::string& text, std::initializer_list<const char*> words) {
  for (const char* word : words) EXPECT_NE(text.find(word), std::string::npos) << word << " is not in: " << text;
}

struct Damage {
  const char* name;
  std::function<void(ArrayFile&)> apply;
  std::initializer_list<const char*> words;
};

TEST(DamagedMano, IsRefusedWithTheKeyAndWhatWasExpected) {
  const auto reshape = [](const char* key, std::vector<std::size_t> shape) {
    return [=](ArrayFile& file) {
      std::size_t count = 1;
      for (const std::size_t n : shape) count *= n;
      file.arrays.at(key) = {shape, std::vector<double>(count, 0.0)};
    };
  };
  const auto set = [](const char* key, std::size_t element, double value) {
    return [=](ArrayFile& file) { file.arrays.at(key).values.at(element) = value; };
  };
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  const Damage damages[] = {
      {"vertices", reshape("v_template", {777, 3}), {"v_template", "777x3", "778x3"}},
      {"transposed vertices", reshape("v_template", {3, 778}), {"v_template", "3x778", "778x3"}},
      {"triangles", reshape("f", {1538, 4}), {"f has shape 1538x4", "anyx3"}},
      {"no triangles", reshape("f", {0, 3}), {"f has shape 0x3"}},
      {"too many triangles", reshape("f", {5000, 3}), {"f has 5000", "4096"}},
      {"regressor", reshape("J_regressor", {16, 6890}), {"J_regressor", "16x6890", "16x778"}},
      {"weights", reshape("weights", {778, 24}), {"weights", "778x24", "778x16"}},
      {"posedirs", reshape("posedirs", {778, 3, 134}), {"posedirs", "778x3x134", "778x3x135"}},
      {"flat posedirs", reshape("posedirs", {2334, 135}), {"posedirs", "2334x135", "778x3x135"}},
      {"shapedirs", reshape("shapedirs", {778, 3, 9}), {"shapedirs", "778x3x9", "778x3x10"}},
      {"tree", reshape("kintree_table", {16, 2}), {"kintree_table", "16x2", "2x16"}},
      {"vertex not a number", set("v_template", 5, nan), {"v_template", "not finite", "5"}},
      {"infinite weight", set("weights", 99, inf), {"weights", "not finite"}},
      {"infinite corrective", set("posedirs", 99, -inf), {"posedirs", "not finite"}},
      {"infinite shape", set("shapedirs", 99, inf), {"shapedirs", "not finite"}},
      {"infinite regressor", set("J_regressor", 99, inf), {"J_regressor", "not finite"}},
      {"corner beyond", set("f", 0, 778.0), {"f holds 778", "0 to 777"}},
      {"negative corner", set("f", 0, -1.0), {"f holds -1"}},
      {"fractional corner", set("f", 0, 1.5), {"f holds 1.5"}},
      {"sum of weights", set("weights", 16 * 7 + 15, 0.9), {"weights of vertex 7", "expected 1"}},
      {"root has a parent", set("kintree_table", 0, 3.0), {"kintree_table", "none"}},
      {"parent", set("kintree_table", 5, 1.0), {"kintree_table", "joint 5", "parent 4"}},
      {"joint number", set("kintree_table", 16 + 9, 10.0), {"kintree_table"}},
      {"side", [](ArrayFile& file) { file.side = "left"; }, {"side is left", "right hand"}},
      {"millimetres",
       [](ArrayFile& file) {
         for (double& x : file.arrays.at("v_template").values) x *= 1000.0;
       },
       {"v_template", "metres"}},
      {"another frame",
       [](ArrayFile& file) {
         auto& x = file.arrays.at("v_template").values;
         for (std::size_t v = 0; v < 778; ++v) std::swap(x[3 * v], x[3 * v + 1]);
       },
       {"v_template", "along x"}},
  };
  for (const Damage& damage : damages) {
    SCOPED_TRACE(damage.name);
    ArrayFile file = synthetic_arrays(Side::kRight, kSeed);
    damage.apply(file);
    const std::string text = message(make_model(file));
    expect_named(text, damage.words);
    EXPECT_EQ(text.find('\n'), std::string::npos);
  }
}

TEST(DamagedMano, NamesEveryMissingKey) {
  const ArrayFile whole = synthetic_arrays(Side::kRight, kSeed);
  for (const auto& [key, array] : whole.arrays) {
    ArrayFile file = whole;
    file.arrays.erase(key);
    expect_named(message(make_model(file)), {key.c_str(), "missing"});
  }
}

TEST(DamagedMano, IsRefusedWhenTheSparseRegressorIsNotCompressedColumns) {
  const ArrayFile whole = test::with_sparse_regressor(synthetic_arrays(Side::kRight, kSeed));
  ASSERT_TRUE(make_model(whole));
  const auto damaged = [&](const char* key, std::size_t element, double value) {
    ArrayFile file = whole;
    file.arrays.at(key).values.at(element) = value;
    return message(make_model(file));
  };
  expect_named(damaged("J_regressor.indices", 3, 16.0), {"J_regressor.indices holds 16", "0 to 15"});
  expect_named(damaged("J_regressor.indptr", 0, 1.0), {"J_regressor.indptr"});
  expect_named(damaged("J_regressor.indptr", 400, 2.0), {"J_regressor.indptr", "rise"});
  expect_named(damaged("J_regressor.indptr", 778, 479.0), {"J_regressor.indptr"});
  expect_named(damaged("J_regressor.indptr", 10, 1e9), {"J_regressor.indptr"});
  for (const char* key : {"J_regressor.data", "J_regressor.indices", "J_regressor.indptr"}) {
    ArrayFile file = whole;
    file.arrays.at(key).values.pop_back();
    --file.arrays.at(key).shape[0];
    expect_named(message(make_model(file)), {"J_regressor"});
  }
}

TEST(DamagedJson, IsRefused) {
  const auto refusal = [](const std::string& text) { return message(parse_model(text)); };
  expect_named(refusal(""), {"neither JSON nor .npz"});
  expect_named(refusal("[1, 2]"), {"neither JSON nor .npz"});
  expect_named(refusal("{"), {"not valid JSON"});
  expect_named(refusal("{}"), {"v_template is missing"});
  expect_named(refusal(R"({"v_template": [[1, 2, 3], [4, 5]]})"), {"v_template", "regular"});
  expect_named(refusal(R"({"v_template": [[1, 2, 3], 4]})"), {"v_template", "regular"});
  expect_named(refusal(R"({"v_template": [1, [2]]})"), {"v_template", "regular"});
  expect_named(refusal(R"({"v_template": [[], 1]})"), {"v_template", "regular"});
  expect_named(refusal(R"({"v_template": [[[[1]]]]})"), {"v_template", "three dimensions"});
  expect_named(refusal(R"({"v_template": []})"), {"v_template", "has shape 0"});
  expect_named(refusal(R"({"v_template": 5})"), {"v_template", "a single number"});
  expect_named(refusal(R"({"v_template": [["a"]]})"), {"v_template", "text"});
  expect_named(refusal(R"({"v_template": [null]})"), {"v_template", "null"});
  expect_named(refusal(R"({"v_template": {"a": 1}})"), {"v_template", "an object"});
  expect_named(refusal(R"({"v_template": [{"a": 1}]})"), {"v_template", "an object"});
  expect_named(refusal(R"({"v_template": [1], "v_template": [1]})"), {"v_template", "twice"});
  expect_named(refusal(R"({"side": "both"})"), {"side", "both"});
  expect_named(refusal(R"({"side": ["left"]})"), {"side"});
  expect_named(refusal(R"({"v_template": [1e999]})"), {"not valid JSON"});
  expect_named(refusal(R"({"v_template": [NaN]})"), {"not valid JSON"});
  expect_named(refusal(R"({"other": )" + std::string(40, '[') + std::string(40, ']') + "}"), {"nested"});
  std::string many = R"({"f": [0)";
  for (std::size_t i = 0; i < kMaxNumbers; ++i) many += ",0";
  expect_named(refusal(many + "]}"), {"f makes the file too large"});
}

TEST(DamagedJson, IsRefusedWhereverItIsCutOff) {
  const std::string whole = test::to_json(synthetic_arrays(Side::kRight, kSeed));
  embody::test::RandomValues random(42);
  for (int trial = 0; trial < 10; ++trial) {
    const auto size = static_cast<std::size_t>(random(1.0, static_cast<double>(whole.size())));
    expect_named(message(parse_model(std::string_view(whole).substr(0, size))), {"not valid JSON"});
  }
}

TEST(DamagedJson, MayHoldAnythingUnderOtherKeys) {
  std::string text = test::to_json(synthetic_arrays(Side::kRight, kSeed));
  text.insert(1, R"("note": "x", "more": [[1, "a", {"f": [1]}], null, true], "bs_type": {"v_template": 3}, )");
  EXPECT_EQ(message(parse_model(text)), "accepted");
}

TEST(DamagedNpy, IsRefusedWithTheKey) {
  const auto refusal = [](const std::string& header, const std::string& bytes = {}) {
    return message(parse_npy(npy_with_header(header, bytes), "posedirs", 1000));
  };
  expect_named(message(parse_npy("", "posedirs", 10)), {"posedirs is not a NumPy array"});
  expect_named(message(parse_npy("\x93NUMPX 123456789", "posedirs", 10)), {"posedirs is not a NumPy array"});
  expect_named(message(parse_npy("\x93NUMPY\x09.12345678", "posedirs", 10)), {"posedirs has version 9"});
  const char* const broken[] = {"",
                                "{",
                                "{}",
                                "{'descr': '<f8'}",
                                "{'descr': '<f8', 'fortran_order': Maybe, 'shape': (1,)}",
                                "{'descr': '<f8', 'fortran_order': False, 'shape': (-1,)}",
                                "{'descr': '<f8', 'fortran_order': False, 'shape': (1}",
                                "{'descr': '<f8', 'fortran_order': False, 'shape': 1}",
                                "{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999999999999,)}",
                                "{'descr': '<f8', 'descr': '<f8', 'fortran_order': False, 'shape': (1,)}",
                                "{'descr': '<f8', 'fortran_order': False, 'shape': (1,), 'more': 1}",
                                "{'descr': '<f8', 'fortran_order': False, 'shape': (1,)} x",
                                "{'descr': '<f8, 'fortran_order': False, 'shape': (1,)}",
                                "{'descr': [('a', '<f8')], 'fortran_order': False, 'shape': (1,)}"};
  for (const char* header : broken) {
    SCOPED_TRACE(header);
    expect_named(refusal(header, std::string(8, '\0')), {"posedirs", "broken NumPy header"});
  }
  for (const char* descr : {">f8", "<f2", "<i2", "|b1", "<U5", "<c16", ""}) {
    expect_named(refusal("{'descr': '" + std::string(descr) + "', 'fortran_order': False, 'shape': (1,)}"),
                 {"posedirs has element type", descr});
  }
  expect_named(refusal("{'descr': '|O', 'fortran_order': False, 'shape': (1,)}"), {"posedirs", "mano-pickle-to-npz"});
  expect_named(refusal("{'descr': '<f8', 'fortran_order': False, 'shape': (1,1,1,1)}", std::string(8, '\0')),
               {"posedirs has 4 dimensions"});
  expect_named(refusal("{'descr': '<f8', 'fortran_order': False, 'shape': (2,)}", std::string(15, '\0')),
               {"posedirs has 15 bytes", "2 needs 16"});
  expect_named(refusal("{'descr': '<f8', 'fortran_order': False, 'shape': (1001,)}"), {"posedirs", "too large"});
  expect_named(refusal("{'descr': '<f8', 'fortran_order': False, 'shape': (4294967296, 4294967296)}"),
               {"posedirs", "too large"});
}

TEST(DamagedNpz, IsRefused) {
  const ArrayFile file = synthetic_arrays(Side::kRight, kSeed);
  expect_named(message(parse_model(test::to_npz(file, true).substr(0, 5000))), {"broken zip"});
  expect_named(message(parse_model("PK\x03\x04 and so on")), {"broken zip"});
  expect_named(message(parse_model(test::to_zip({{"other.npy", "x"}}, false))), {"v_template is missing"});
  expect_named(message(parse_model(test::to_zip({{"posedirs.npy", "x"}}, false))), {"posedirs is not a NumPy array"});
  std::string bytes = test::to_npz(file, false);
  bytes[bytes.find("posedirs.npy") + 5000] ^= 1;  // its checksum tells
  expect_named(message(parse_model(bytes)), {"posedirs", "damaged"});
}

TEST(DamagedNpz, NeverUnpacksABomb) {
  const std::string zeros(kMaxNumbers * 8 + 5000, '\0');  // deflates a thousandfold
  const std::string bomb = test::to_zip({{"weights.npy", zeros}}, true);
  ASSERT_LT(bomb.size(), zeros.size() / 100);
  expect_named(message(parse_model(bomb)), {"weights", "too large"});
  // Many entries, each of a size that a model may have.
  const std::string large =
      test::to_npy({{kMaxNumbers / 2 + 1}, std::vector<double>(kMaxNumbers / 2 + 1)}, "<f8", false);
  expect_named(message(parse_model(test::to_zip({{"weights.npy", large}, {"f.npy", large}}, true))),
               {"f", "too large"});
}

TEST(DamagedNpz, SurvivesAnyFlippedByte) {
  const ArrayFile file = synthetic_arrays(Side::kRight, kSeed);
  const std::string whole =
      test::to_zip({{"kintree_table.npy", test::to_npy(file.arrays.at("kintree_table"), "<u4", false)},
                    {"f.npy", test::to_npy(file.arrays.at("f"), "<u4", false)}},
                   true);
  embody::test::RandomValues random(43);
  for (int trial = 0; trial < 2000; ++trial) {
    std::string bytes = whole;
    bytes[static_cast<std::size_t>(random(0.0, static_cast<double>(bytes.size())))] =
        static_cast<char>(static_cast<int>(random(0.0, 256.0)));
    EXPECT_NE(message(parse_model(bytes)), "accepted");  // it is not whole anyway
  }
}

TEST(Pickles, AreRecognisedAndSentToTheConverter) {
  for (const std::string& bytes : {std::string("\x80\x02}q\x01."), std::string("(dp0\nS'f'\np1\n"),
                                   std::string("}q\x01(U"), std::string("\x80\x04\x95 and more")}) {
    expect_named(message(parse_model(bytes)), {"pickle", "scripts/mano-pickle-to-npz"});
  }
}

}  // namespace
}  // namespace embody::mano
