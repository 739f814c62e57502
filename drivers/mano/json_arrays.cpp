#include <array>
#include <nlohmann/json.hpp>

#include "drivers/mano/array_file.hpp"

namespace embody::mano {
namespace {

using nlohmann::json;

constexpr std::size_t kUnknown = static_cast<std::size_t>(-1);
constexpr std::size_t kMaxDepth = 32;  // of values that are skipped

/// Collects the wanted arrays from the parser's events, so that nothing else is ever held in memory. Each event returns
/// false to stop.
class ArrayCollector : public nlohmann::json_sax<json> {
 public:
  [[nodiscard]] ArrayFile& file() noexcept { return file_; }
  [[nodiscard]] const Error& error() const noexcept { return error_; }

  bool null() override { return other("null"); }
  bool boolean(bool) override { return other("true or false"); }
  bool number_integer(number_integer_t value) override { return number(static_cast<double>(value)); }
  bool number_unsigned(number_unsigned_t value) override { return number(static_cast<double>(value)); }
  bool number_float(number_float_t value, const string_t&) override { return number(value); }
  bool binary(binary_t&) override { return other("binary data"); }

  bool string(string_t& value) override {
    if (skipped_ > 0 || key_ != "side") return other("text");
    if (value != "left" && value != "right") {
      return fail(make_error(Errc::kMalformed, "side is '%.20s'; expected left or right", value.c_str()));
    }
    file_.side = value;
    return true;
  }

  bool start_object(std::size_t) override {
    if (objects_ == 0) return ++objects_ == 1;
    if (collecting() && key_ == "J_regressor" && levels_ == 0 && objects_ == 1) {
      key_.clear();
      return ++objects_ == 2;
    }
    return open("an object");
  }
  bool end_object() override {
    if (skipped_ > 0) return close();
    --objects_;
    key_.clear();
    return true;
  }

  bool key(string_t& name) override {
    if (skipped_ > 0) return true;
    key_ = objects_ == 2 ? "J_regressor." + name.substr(0, 40) : name.substr(0, 40);
    if (key_ != "side" && !is_wanted(key_)) key_.clear();
    if (!key_.empty() && file_.arrays.count(key_) > 0)
      return fail(make_error(Errc::kMalformed, "%s is there twice", key_.c_str()));
    return true;
  }

  bool start_array(std::size_t) override {
    if (objects_ == 0) return fail(make_error(Errc::kMalformed, "the file is a list; expected an object"));
    if (!collecting() || key_ == "side") return open("a list");
    if (levels_ == 0) begin_array();
    if (levels_ == kMaxDimensions)
      return fail(make_error(Errc::kMalformed, "%s has more than three dimensions", key_.c_str()));
    if (leaf_level_ != 0 && levels_ >= leaf_level_) return ragged();
    counts_[levels_++] = 0;
    return true;
  }
  bool end_array() override {
    if (skipped_ > 0) return close();
    const std::size_t count = counts_[--levels_];
    std::size_t& size = shape_[levels_];
    if (size == kUnknown) size = count;
    if (size != count) return ragged();
    if (levels_ > 0) {
      ++counts_[levels_ - 1];
      return true;
    }
    return finish_array();
  }

  bool parse_error(std::size_t position, const std::string&, const json::exception&) override {
    return fail(make_error(Errc::kMalformed, "not valid JSON near byte %zu", position));
  }

 private:
  [[nodiscard]] bool collecting() const noexcept { return skipped_ == 0 && !key_.empty(); }

  bool fail(const Error& error) noexcept {
    error_ = error;
    return false;
  }
  bool ragged() {
    return fail(
        make_error(Errc::kMalformed, "%s is not a regular array: its lists differ in length or depth", key_.c_str()));
  }

  /// A value that is neither a number nor a list, where one may be skipped.
  bool other(const char* what) {
    if (objects_ == 0) return fail(make_error(Errc::kMalformed, "the file is %s; expected an object", what));
    if (!collecting()) return true;
    return fail(make_error(Errc::kMalformed, "%s holds %s; expected numbers", key_.c_str(), what));
  }
  /// Begins a list or object that is skipped.
  bool open(const char* what) {
    if (collecting()) return fail(make_error(Errc::kMalformed, "%s holds %s where it should not", key_.c_str(), what));
    if (++skipped_ > kMaxDepth)
      return fail(make_error(Errc::kMalformed, "lists and objects are nested more than %zu deep", kMaxDepth));
    return true;
  }
  bool close() {
    --skipped_;
    return true;
  }

  bool number(double value) {
    if (!collecting() || levels_ == 0) return other("a single number");
    if (leaf_level_ == 0) leaf_level_ = levels_;
    if (leaf_level_ != levels_) return ragged();
    if (numbers_ == kMaxNumbers)
      return fail(make_error(Errc::kMalformed, "%s makes the file too large for a hand model", key_.c_str()));
    ++numbers_;
    ++counts_[levels_ - 1];
    values_.push_back(value);
    return true;
  }

  void begin_array() {
    values_.clear();
    leaf_level_ = 0;
    shape_.fill(kUnknown);
  }
  bool finish_array() {
    Array array;
    std::size_t product = 1;
    for (const std::size_t n : shape_) {
      if (n == kUnknown) break;
      array.shape.push_back(n);
      product *= n;
    }
    if (product != values_.size()) return ragged();
    array.values.assign(values_.begin(), values_.end());
    file_.arrays.emplace(key_, std::move(array));
    return true;
  }

  ArrayFile file_;
  Error error_;
  std::size_t objects_{0};  // 1: in the file's object, 2: in J_regressor
  std::size_t skipped_{0};  // depth in a value that is not wanted
  std::string key_;         // of the value being read; empty: not wanted
  std::size_t levels_{0};   // depth of lists in the array being read
  std::size_t leaf_level_{0};
  std::array<std::size_t, kMaxDimensions> counts_{};
  std::array<std::size_t, kMaxDimensions> shape_{};
  std::vector<double> values_;
  std::size_t numbers_{0};
};

}  // namespace

Result<ArrayFile> read_json(std::string_view text) {
  ArrayCollector collector;
  if (!json::sax_parse(text.begin(), text.end(), &collector)) return collector.error();
  return std::move(collector.file());
}

}  // namespace embody::mano
