#include <zip.h>

#include <memory>

#include "drivers/mano/array_file.hpp"

namespace embody::mano {
namespace {

constexpr std::size_t kMaxZipBytes = std::size_t{64} << 20;  // bounds what the directory of entries can take
constexpr std::size_t kMaxEntryBytes = kMaxNumbers * sizeof(double) + 4096;

struct CloseZip {
  void operator()(zip_t* archive) const noexcept { zip_discard(archive); }
};
struct CloseEntry {
  void operator()(zip_file_t* entry) const noexcept { zip_fclose(entry); }
};
using Archive = std::unique_ptr<zip_t, CloseZip>;
using Entry = std::unique_ptr<zip_file_t, CloseEntry>;

Archive open_archive(std::string_view bytes) {
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* source = zip_source_buffer_create(bytes.data(), bytes.size(), 0, &error);
  zip_t* archive = source == nullptr ? nullptr : zip_open_from_source(source, ZIP_RDONLY, &error);
  if (archive == nullptr && source != nullptr) zip_source_free(source);
  zip_error_fini(&error);
  return Archive(archive);
}

/// Name of the array in an entry; empty when it is not wanted. The regressor's parts are J_regressor_data and so on.
std::string key_of(std::string_view entry) {
  constexpr std::string_view kSuffix = ".npy", kRegressor = "J_regressor_";
  if (entry.size() <= kSuffix.size() || entry.substr(entry.size() - kSuffix.size()) != kSuffix) return {};
  std::string key(entry.substr(0, entry.size() - kSuffix.size()));
  if (key.compare(0, kRegressor.size(), kRegressor) == 0) key[kRegressor.size() - 1] = '.';
  return is_wanted(key) ? key : std::string();
}

/// Unpacks exactly `size` bytes and checks that the entry ends there with the right checksum.
bool unpack(zip_t* archive, zip_uint64_t index, std::size_t size, std::string& bytes) {
  const Entry entry(zip_fopen_index(archive, index, 0));
  if (!entry) return false;
  bytes.resize(size);
  std::size_t done = 0;
  while (done < size) {
    const zip_int64_t count = zip_fread(entry.get(), bytes.data() + done, size - done);
    if (count <= 0) return false;
    done += static_cast<std::size_t>(count);
  }
  char beyond = 0;
  return zip_fread(entry.get(), &beyond, 1) == 0;
}

}  // namespace

Result<ArrayFile> read_npz(std::string_view bytes) {
  if (bytes.size() > kMaxZipBytes) {
    return make_error(Errc::kUnsupported, "an .npz file of more than %zu MiB is no hand model", kMaxZipBytes >> 20);
  }
  const Archive archive = open_archive(bytes);
  if (!archive) return make_error(Errc::kMalformed, "the .npz file is a broken zip archive");
  ArrayFile file;
  std::size_t numbers_left = kMaxNumbers;
  std::string unpacked;
  const zip_int64_t entries = zip_get_num_entries(archive.get(), 0);
  for (zip_int64_t i = 0; i < entries; ++i) {
    zip_stat_t info;
    const auto index = static_cast<zip_uint64_t>(i);
    if (zip_stat_index(archive.get(), index, 0, &info) != 0 || (info.valid & ZIP_STAT_NAME) == 0) continue;
    const std::string key = key_of(info.name);
    if (key.empty()) continue;
    if ((info.valid & ZIP_STAT_SIZE) == 0 || info.size > kMaxEntryBytes) {
      return make_error(Errc::kUnsupported, "%s would unpack to %llu bytes, too large for a hand model", key.c_str(),
                        static_cast<unsigned long long>(info.size));
    }
    if (!unpack(archive.get(), index, static_cast<std::size_t>(info.size), unpacked)) {
      return make_error(Errc::kMalformed, "%s cannot be unpacked: the .npz file is damaged", key.c_str());
    }
    auto array = parse_npy(unpacked, key, numbers_left);
    if (!array) return array.error();
    numbers_left -= array->values.size();
    if (!file.arrays.emplace(key, std::move(*array)).second) {
      return make_error(Errc::kMalformed, "the .npz file holds %s twice", key.c_str());
    }
  }
  return file;
}

}  // namespace embody::mano
