#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>

#include "drivers/mano/array_file.hpp"

namespace embody::mano {
namespace {

static_assert(std::endian::native == std::endian::little);

/// What the header says. `descr` is the NumPy type, such as "<f8".
struct Header {
  std::string_view descr;
  bool fortran_order{false};
  std::vector<std::size_t> shape;
};

/// Reads the one Python dictionary that a header may hold: {'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }.
class HeaderReader {
 public:
  explicit HeaderReader(std::string_view text) : text_(text) {}

  bool read(Header& header) {
    bool descr = false, order = false, shape = false;
    if (!take('{')) return false;
    while (!take('}')) {
      std::string_view key;
      if (!quoted(key) || !take(':')) return false;
      if (key == "descr" && !std::exchange(descr, true)) {
        if (peek() == '[' || !quoted(header.descr)) return false;
      } else if (key == "fortran_order" && !std::exchange(order, true)) {
        if (!boolean(header.fortran_order)) return false;
      } else if (key == "shape" && !std::exchange(shape, true)) {
        if (!tuple(header.shape)) return false;
      } else {
        return false;
      }
      if (!take(',') && peek() != '}') return false;
    }
    return descr && order && shape && peek() == '\0';
  }

 private:
  char peek() {
    while (!text_.empty() && (text_.front() == ' ' || text_.front() == '\n')) text_.remove_prefix(1);
    return text_.empty() ? '\0' : text_.front();
  }
  bool take(char c) {
    if (peek() != c || c == '\0') return false;
    text_.remove_prefix(1);
    return true;
  }
  bool quoted(std::string_view& value) {
    const char quote = peek();
    if (quote != '\'' && quote != '"') return false;
    const std::size_t end = text_.find(quote, 1);
    if (end == std::string_view::npos) return false;
    value = text_.substr(1, end - 1);
    text_.remove_prefix(end + 1);
    return true;
  }
  bool boolean(bool& value) {
    (void)peek();
    value = text_.substr(0, 4) == "True";
    if (!value && text_.substr(0, 5) != "False") return false;
    text_.remove_prefix(value ? 4 : 5);
    return true;
  }
  bool tuple(std::vector<std::size_t>& values) {
    if (!take('(')) return false;
    while (!take(')')) {
      (void)peek();
      std::size_t n = 0;
      const auto [end, error] = std::from_chars(text_.data(), text_.data() + text_.size(), n);
      if (error != std::errc{} || values.size() > 8) return false;
      text_.remove_prefix(static_cast<std::size_t>(end - text_.data()));
      values.push_back(n);
      if (!take(',') && peek() != ')') return false;
    }
    return true;
  }

  std::string_view text_;
};

std::uint32_t little_endian(std::string_view bytes) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data(), bytes.size());
  return value;
}

template <class T>
void convert(std::string_view bytes, std::vector<double>& values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    T value;
    std::memcpy(&value, bytes.data() + i * sizeof(T), sizeof(T));
    values[i] = static_cast<double>(value);
  }
}

using Convert = void (*)(std::string_view bytes, std::vector<double>& values);

Convert conversion_of(std::string_view descr, std::size_t& item_bytes) {
  struct Type {
    std::string_view descr;
    std::size_t bytes;
    Convert convert;
  };
  static constexpr Type kTypes[] = {{"<f8", 8, &convert<double>},        {"<f4", 4, &convert<float>},
                                    {"<i8", 8, &convert<std::int64_t>},  {"<i4", 4, &convert<std::int32_t>},
                                    {"<u8", 8, &convert<std::uint64_t>}, {"<u4", 4, &convert<std::uint32_t>}};
  for (const Type& type : kTypes) {
    item_bytes = type.bytes;
    if (type.descr == descr) return type.convert;
  }
  return nullptr;
}

/// First index fastest becomes last index fastest.
void reorder(Array& array) {
  std::vector<double> values(array.values.size());
  std::vector<std::size_t> index(array.shape.size(), 0);
  for (double& value : values) {
    std::size_t from = 0;
    for (std::size_t d = index.size(); d-- > 0;) from = from * array.shape[d] + index[d];
    value = array.values[from];
    for (std::size_t d = index.size(); d-- > 0;) {
      if (++index[d] < array.shape[d]) break;
      index[d] = 0;
    }
  }
  array.values = std::move(values);
}

}  // namespace

Result<Array> parse_npy(std::string_view bytes, std::string_view key, std::size_t max_numbers) {
  const int name_size = static_cast<int>(std::min<std::size_t>(key.size(), 60));
  const char* name = key.data();
  if (bytes.size() < 12 || bytes.substr(0, 6) != "\x93NUMPY") {
    return make_error(Errc::kMalformed, "%.*s is not a NumPy array (.npy)", name_size, name);
  }
  const int version = static_cast<unsigned char>(bytes[6]);
  if (version < 1 || version > 3) {
    return make_error(Errc::kUnsupported, "%.*s has version %d of NumPy's format; expected 1, 2 or 3", name_size, name,
                      version);
  }
  const std::size_t size_bytes = version == 1 ? 2 : 4;
  const std::size_t header_bytes = little_endian(bytes.substr(8, size_bytes));
  bytes.remove_prefix(8 + size_bytes);
  Header header;
  if (header_bytes > bytes.size() || !HeaderReader(bytes.substr(0, header_bytes)).read(header)) {
    return make_error(Errc::kMalformed, "%.*s has a broken NumPy header", name_size, name);
  }
  bytes.remove_prefix(header_bytes);

  std::size_t item_bytes = 0;
  const Convert convert_all = conversion_of(header.descr, item_bytes);
  if (convert_all == nullptr) {
    if (header.descr == "|O") {
      return make_error(Errc::kUnsupported,
                        "%.*s holds Python objects, not numbers; convert the original pickle with "
                        "scripts/mano-pickle-to-npz",
                        name_size, name);
    }
    return make_error(Errc::kUnsupported, "%.*s has element type '%.*s'; expected little-endian f4 f8 i4 i8 u4 or u8",
                      name_size, name, static_cast<int>(std::min<std::size_t>(header.descr.size(), 20)),
                      header.descr.data());
  }
  if (header.shape.size() > kMaxDimensions) {
    return make_error(Errc::kUnsupported, "%.*s has %zu dimensions; expected at most %zu", name_size, name,
                      header.shape.size(), kMaxDimensions);
  }
  std::size_t count = 1;
  for (const std::size_t n : header.shape) {
    if (n != 0 && count > max_numbers / n) {
      return make_error(Errc::kUnsupported, "%.*s has shape %.60s, too large for a hand model", name_size, name,
                        shape_text(header.shape).c_str());
    }
    count *= n;
  }
  if (bytes.size() != count * item_bytes) {
    return make_error(Errc::kMalformed, "%.*s has %zu bytes of data; its shape %.60s needs %zu", name_size, name,
                      bytes.size(), shape_text(header.shape).c_str(), count * item_bytes);
  }
  Array array{std::move(header.shape), std::vector<double>(count)};
  convert_all(bytes, array.values);
  if (header.fortran_order) reorder(array);
  return array;
}

}  // namespace embody::mano
