#include "tactus/io/labels/label_bytes.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "tactus/base/error.h"
#include "tactus/base/printable.h"

namespace tactus {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t kBlock = std::size_t{1} << 16, kMaxHeaderBytes = std::size_t{1} << 20;

}  // namespace

LabelBytes::LabelBytes(const std::string& path, Packing packing) : path_(path), block_(kBlock) {
  std::error_code failed;
  const fs::file_status status = fs::status(path, failed);
  const auto fail = [&](const std::string& why) {
    throw Error("can't read '" + printable(path) + "': " + why);
  };
  if (fs::is_directory(status)) fail(std::strerror(EISDIR));
  if (fs::exists(status) && !fs::is_regular_file(status)) fail("not a regular file");
  file_.reset(std::fopen(path.c_str(), "rb"));
  if (!file_) fail(std::strerror(errno));
  if (packing == Packing::yes ||
      (packing == Packing::perhaps && fill() && end_ >= 2 && block_[0] == 0x1f && block_[1] == 0x8b))
    unpack();
}

LabelBytes::~LabelBytes() {
  if (packed_) inflateEnd(&stream_);
}

bool LabelBytes::fill() {
  if (next_ < end_) return true;
  next_ = 0;
  end_ = std::fread(block_.data(), 1, block_.size(), file_.get());
  return end_ > 0;
}

void LabelBytes::unpack() {
  if (packed_) throw Error(path_ + ": compressed twice");
  constexpr int kZlibOrGzip = 32 + MAX_WBITS;
  if (inflateInit2(&stream_, kZlibOrGzip) != Z_OK) throw Error(path_ + ": no memory to unpack it");
  packed_ = true;
}

std::size_t LabelBytes::read(void* data, std::size_t bytes) {
  auto* to = static_cast<unsigned char*>(data);
  std::size_t done = 0;
  while (done < bytes && !ended_ && fill()) {
    if (!packed_) {
      const std::size_t n = std::min(bytes - done, end_ - next_);
      std::memcpy(to + done, block_.data() + next_, n);
      next_ += n;
      done += n;
      continue;
    }
    const std::size_t space = std::min(bytes - done, std::size_t{1} << 30);
    stream_.next_in = block_.data() + next_;
    stream_.avail_in = static_cast<unsigned>(end_ - next_);
    stream_.next_out = to + done;
    stream_.avail_out = static_cast<unsigned>(space);
    const int status = inflate(&stream_, Z_NO_FLUSH);
    next_ = end_ - stream_.avail_in;
    done += space - stream_.avail_out;
    if (status == Z_STREAM_END) {
      ended_ = !fill() || block_[next_] != 0x1f;  // gzip files may stand behind each other
      if (!ended_) inflateReset(&stream_);
    } else if (status != Z_OK && status != Z_BUF_ERROR) {
      throw Error(path_ + ": damaged compressed data (" + (stream_.msg == nullptr ? "zlib" : stream_.msg) +
                  ")");
    }
  }
  return done;
}

bool LabelBytes::line(std::string& text) {
  text.clear();
  for (char c; read(&c, 1) == 1;) {
    if (c == '\n') {
      if (!text.empty() && text.back() == '\r') text.pop_back();
      return true;
    }
    if (++line_bytes_ > kMaxHeaderBytes) throw Error(path_ + ": its header has no end within 1 MB");
    text += c;
  }
  return !text.empty();
}

void LabelBytes::skip(std::uint64_t bytes) {
  std::vector<char> away(kBlock);
  while (bytes > 0) {
    const std::size_t n =
        read(away.data(), static_cast<std::size_t>(std::min<std::uint64_t>(bytes, away.size())));
    if (n == 0) return;
    bytes -= n;
  }
}

std::string named_data_file(const std::string& header_path, const std::string& name) {
  const auto fail = [&] {
    throw Error(header_path + ": its data are in '" + printable(name) +
                "', expected a regular file in the folder of the header or below");
  };
  if (name.empty() || name.find('\0') != name.npos) fail();
  std::error_code failed;
  const fs::path given = fs::path(header_path).parent_path();
  const fs::path folder = fs::weakly_canonical(given.empty() ? "." : given, failed);
  const fs::path real = fs::weakly_canonical(folder / name, failed);
  if (failed || !fs::is_regular_file(real, failed)) fail();
  if (std::mismatch(folder.begin(), folder.end(), real.begin(), real.end()).first != folder.end()) fail();
  return real.string();
}

}  // namespace tactus
