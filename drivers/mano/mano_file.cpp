#include "drivers/mano/mano_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

namespace embody::mano {
namespace {

class File {
 public:
  File(const std::string& path, int flags) : fd_(::open(path.c_str(), flags | O_CLOEXEC, 0666)) {}
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  ~File() {
    if (fd_ >= 0) ::close(fd_);
  }
  [[nodiscard]] int get() const noexcept { return fd_; }

 private:
  int fd_;
};

Error system_error(const char* action, const std::string& path, int cause) {
  const Errc code = cause == ENOENT                     ? Errc::kNotFound
                    : cause == EACCES || cause == EPERM ? Errc::kPermission
                                                        : Errc::kIo;
  return make_error(code, "cannot %s '%.150s': %s", action, path.c_str(), std::strerror(cause));
}

/// Reads until the end of the file, at most `size` bytes; false: errno says why.
bool read_whole(int fd, std::size_t size, std::string& bytes) {
  bytes.resize(size);
  std::size_t done = 0;
  while (done < size) {
    const ssize_t count = ::read(fd, bytes.data() + done, size - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return false;
    if (count == 0) break;
    done += static_cast<std::size_t>(count);
  }
  bytes.resize(done);
  return true;
}

bool write_whole(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(fd, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
  return ::fsync(fd) == 0;
}

bool starts_with_any(std::string_view bytes, const auto& beginnings) {
  return std::any_of(beginnings.begin(), beginnings.end(),
                     [bytes](std::string_view begin) { return bytes.substr(0, begin.size()) == begin; });
}

bool is_pickle(std::string_view bytes) {
  if (bytes.size() > 2 && bytes[0] == '\x80' && bytes[1] >= 2 && bytes[1] <= 5) return true;
  constexpr std::array<std::string_view, 5> kText{"(dp", "(lp", "(i", "cnumpy", "ccopy_reg"};  // protocols 0 and 1
  return starts_with_any(bytes, kText) || bytes.substr(0, 2) == "}q";
}

Error prefixed(const std::string& path, const Error& error) {
  const std::string text(error.detail.view());
  const std::size_t cut = path.size() > 80 ? path.size() - 80 : 0;  // the end of a path tells more
  return make_error(error.code, "%s%s: %s", cut > 0 ? "..." : "", path.c_str() + cut, text.c_str());
}

}  // namespace

Result<ManoModel> parse_model(std::string_view bytes) {
  constexpr std::array<std::string_view, 2> kZip{"PK\x03\x04", "PK\x05\x06"};
  if (is_pickle(bytes)) {
    return make_error(Errc::kUnsupported,
                      "this is a Python pickle; convert it first: scripts/mano-pickle-to-npz FILE.pkl FILE.npz");
  }
  const std::size_t text = bytes.find_first_not_of(" \t\r\n");
  const bool zip = starts_with_any(bytes, kZip);
  if (!zip && (text == std::string_view::npos || bytes[text] != '{')) {
    return make_error(Errc::kMalformed, "neither JSON nor .npz; expected a MANO model in one of these");
  }
  const auto file = zip ? read_npz(bytes) : read_json(bytes);
  if (!file) return file.error();
  return make_model(*file);
}

Result<ManoModel> load_model(const std::string& path) {
  const File file(path, O_RDONLY | O_NONBLOCK);  // a pipe without a writer must not block; it is refused below
  struct stat info {};
  if (file.get() < 0 || ::fstat(file.get(), &info) != 0) return system_error("read", path, errno);
  if (!S_ISREG(info.st_mode)) {
    return make_error(Errc::kInvalidArgument, "'%.150s' is not a file; name a MANO model (.json or .npz)",
                      path.c_str());
  }
  const auto size = static_cast<std::size_t>(info.st_size);
  if (size > kMaxFileBytes) {
    return make_error(Errc::kUnsupported, "'%.150s' has %zu MiB, more than %zu: no hand model is that large",
                      path.c_str(), size >> 20, kMaxFileBytes >> 20);
  }
  std::string bytes;
  if (!read_whole(file.get(), size, bytes)) return system_error("read", path, errno);
  auto model = parse_model(bytes);
  if (!model) return prefixed(path, model.error());
  return model;
}

Result<hand::HandData> load_hand(const std::string& path) {
  const auto model = load_model(path);
  if (!model) return model.error();
  return hand_data(*model, path);
}

Status save_model(const ManoModel& model, const std::string& path, bool overwrite) {
  namespace fs = std::filesystem;
  std::error_code failed;
  const fs::path folder = fs::path(path).parent_path();
  if (!folder.empty()) fs::create_directories(folder, failed);
  if (failed) return system_error("create the folder of", path, failed.value());

  const std::string part = path + ".part" + std::to_string(::getpid());
  bool written = false;
  {
    const File file(part, O_WRONLY | O_CREAT | O_EXCL);
    if (file.get() < 0) return system_error("write", part, errno);
    written = write_whole(file.get(), format_model(model));
  }
  // link() refuses an existing target, rename() replaces it; both at once.
  written = written && (overwrite ? std::rename(part.c_str(), path.c_str()) : ::link(part.c_str(), path.c_str())) == 0;
  const int cause = errno;
  if (!written || !overwrite) ::unlink(part.c_str());
  if (written) return {};
  if (cause == EEXIST) {
    return make_error(Errc::kRefused, "'%.150s' exists; use --force to replace it", path.c_str());
  }
  return system_error("write", path, cause);
}

}  // namespace embody::mano
