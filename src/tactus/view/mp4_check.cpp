#include "tactus/view/mp4_check.h"

#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace tactus {
namespace {

struct Range {
  std::uint64_t begin, end;
};

std::optional<std::uint64_t> big_endian(int fd, std::uint64_t at, std::size_t bytes) {
  std::array<unsigned char, 8> raw{};
  if (::pread(fd, raw.data(), bytes, static_cast<off_t>(at)) != static_cast<ssize_t>(bytes)) return {};
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < bytes; ++i) value = value << 8 | raw[i];
  return value;
}

/// Contents of the first box of a kind within `in`; none when it is not there or a box reaches beyond its
/// end.
std::optional<Range> find_box(int fd, Range in, std::string_view kind) {
  std::optional<Range> found;
  for (std::uint64_t at = in.begin; at < in.end;) {
    const auto size32 = big_endian(fd, at, 4), name = big_endian(fd, at + 4, 4);
    if (!size32 || !name) return {};
    std::uint64_t size = *size32, header = 8;
    if (size == 1) {  // a length of 64 bits follows
      size = big_endian(fd, at + 8, 8).value_or(0);
      header = 16;
    }
    if (size < header || size > in.end - at) return {};
    std::uint64_t wanted = 0;
    for (const char c : kind) wanted = wanted << 8 | static_cast<unsigned char>(c);
    if (*name == wanted && !found) found = Range{at + header, at + size};
    at += size;
  }
  return found;
}

}  // namespace

std::string what_is_wrong_with_mp4(int fd, int frames) {
  struct stat status {};
  if (::fstat(fd, &status) != 0 || status.st_size == 0) return "the video encoder wrote nothing";
  std::optional<Range> box = Range{0, static_cast<std::uint64_t>(status.st_size)};
  if (!find_box(fd, *box, "mdat")) return "the video is cut short: its frames are not whole";
  for (const char* kind : {"moov", "trak", "mdia", "minf", "stbl", "stsz"}) {
    box = find_box(fd, *box, kind);
    if (!box) return std::string("the video is cut short: its index has no '") + kind + "'";
  }
  // stsz: version and flags, size of all samples or 0, their number.
  const std::uint64_t count = big_endian(fd, box->begin + 8, 4).value_or(0);
  if (count == static_cast<std::uint64_t>(frames)) return "";
  return "the video is cut short: it holds " + std::to_string(count) + " of " + std::to_string(frames) +
         " frames";
}

}  // namespace tactus
