#include "tactus/rig/wire/recording_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <limits>

#include "tactus/base/error.h"
#include "tactus/base/printable.h"
#include "tactus/rig/wire/rig_bytes.h"

namespace tactus {
namespace {

constexpr std::uint32_t kRecordingVersion = 1;
constexpr std::uint32_t kChunkMagic = 0x4b484354;  // "TCHK"
/// Head of a chunk: magic, kind, bytes of the payload, its hash, hash of these 24 bytes.
constexpr std::size_t kHeadBytes = 32, kHashedHeadBytes = 24;
constexpr std::uint64_t kMostChunkBytes = std::uint64_t{192} << 20;
/// Most frames of one file: 38 hours of 30 frames a second.
constexpr std::size_t kMostFrames = std::size_t{1} << 22;
constexpr std::size_t kMostStatusBytes = 4096;

struct ChunkHead {
  RecordingChunk kind = RecordingChunk::end;
  std::uint64_t bytes = 0, hash = 0;
};

std::vector<Vec2i> sizes_px(const std::vector<Camera>& cameras) {
  std::vector<Vec2i> all;
  for (const Camera& camera : cameras) all.push_back({camera.width_px, camera.height_px});
  return all;
}

/// Images that no reader would take: "7 masks, expected 8"; "" for none. An image without pixels was missed.
template <class Image>
std::string wrong_images(const std::vector<Image>& images, const std::vector<Vec2i>& sizes_px,
                         const char* what) {
  const auto size = [](Vec2i px) { return std::to_string(px.x) + "x" + std::to_string(px.y); };
  if (!images.empty() && images.size() != sizes_px.size())
    return std::to_string(images.size()) + " " + what + ", expected " + std::to_string(sizes_px.size());
  for (std::size_t c = 0; c < images.size(); ++c) {
    const Vec2i px{images[c].width_px, images[c].height_px};
    if (px.x * px.y != 0 && (px.x != sizes_px[c].x || px.y != sizes_px[c].y))
      return std::string(what) + " of " + size(px) + " pixels of camera " + std::to_string(c) +
             ", expected " + size(sizes_px[c]);
  }
  return "";
}

/// None where the bytes are no head.
std::optional<ChunkHead> parse_head(const std::string& bytes) {
  ByteReader in(bytes);
  const auto magic = in.take<std::uint32_t>();
  const auto kind = static_cast<RecordingChunk>(in.take<std::uint32_t>());
  const auto size = in.take<std::uint64_t>(), hash = in.take<std::uint64_t>(), own = in.take<std::uint64_t>();
  if (in.failed() || magic != kChunkMagic || size > kMostChunkBytes) return {};
  if (own != fnv1a(std::string_view(bytes).substr(0, kHashedHeadBytes))) return {};
  return ChunkHead{kind, size, hash};
}

std::string system_reason() { return std::generic_category().message(errno); }

bool is_frame(RecordingChunk kind) {
  return kind == RecordingChunk::set || kind == RecordingChunk::nothing || kind == RecordingChunk::bad;
}

/// Room for the head; the payload follows.
void begin_chunk(RecordingChunk kind, std::string& chunk) {
  chunk.clear();
  put_bytes(chunk, kChunkMagic);
  put_bytes(chunk, kind);
  chunk.resize(kHeadBytes);
}

void seal_chunk(std::string& chunk) {
  const std::string_view payload = std::string_view(chunk).substr(kHeadBytes);
  set_bytes(chunk, 8, static_cast<std::uint64_t>(payload.size()));
  set_bytes(chunk, 16, fnv1a(payload));
  set_bytes(chunk, kHashedHeadBytes, fnv1a(std::string_view(chunk).substr(0, kHashedHeadBytes)));
}

RecordingChunk chunk_of(NextFrame next) {
  if (next == NextFrame::success) return RecordingChunk::set;
  return next == NextFrame::bad_frame ? RecordingChunk::bad : RecordingChunk::nothing;
}

}  // namespace

bool is_recording(const std::string& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) return false;
  char bytes[kRecordingMagic.size()];
  const ssize_t n = ::read(fd, bytes, sizeof bytes);
  ::close(fd);
  return n == static_cast<ssize_t>(sizeof bytes) && std::string_view(bytes, sizeof bytes) == kRecordingMagic;
}

std::string recording_chunk(RecordingChunk kind, std::string_view payload) {
  std::string chunk;
  begin_chunk(kind, chunk);
  chunk += payload;
  seal_chunk(chunk);
  return chunk;
}

std::string recording_start() {
  std::string start(kRecordingMagic);
  put_bytes(start, kRecordingVersion);
  return start;
}

RecordingWriter::RecordingWriter(const std::string& path, const Rig& rig, std::optional<double> fps)
    : path_(path), sizes_px_(sizes_px(rig.cameras)), depth_sizes_px_(sizes_px(rig.depth_cameras)) {
  fd_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NONBLOCK, 0666);
  if (fd_ < 0) throw Error("can't write '" + path + "': " + system_reason());
  struct stat status {};
  const bool is_new = ::fstat(fd_, &status) == 0 && S_ISREG(status.st_mode) && status.st_size == 0;
  if (!is_new) {
    ::close(fd_);
    throw usage_error("can't record to '" + path +
                      "': it is there already; a recording is not overwritten, give another name");
  }
  write(recording_start());
  begin_chunk(RecordingChunk::rig, chunk_);
  put_bytes(chunk_, fps.value_or(0));
  put_rig(rig, chunk_);
  write_chunk();
}

RecordingWriter::~RecordingWriter() {
  if (fd_ >= 0) ::close(fd_);
}

void RecordingWriter::write_chunk() {
  if (chunk_.size() - kHeadBytes > kMostChunkBytes)
    throw Error("can't record to '" + path_ + "': a frame takes " +
                bytes_text(static_cast<double>(chunk_.size() - kHeadBytes)) + ", expected at most " +
                bytes_text(static_cast<double>(kMostChunkBytes)));
  seal_chunk(chunk_);
  write(chunk_);
}

void RecordingWriter::write(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd_, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) throw Error("can't write '" + path_ + "': " + system_reason());
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
}

void RecordingWriter::add(NextFrame next, const FrameSet& frame, const std::string& status) {
  if (next == NextFrame::no_more_data) return;
  if (!std::isfinite(frame.time_s))
    throw Error("can't record to '" + path_ + "': frame " + std::to_string(frame.tick) +
                " has no finite time");
  if (next == NextFrame::success) {
    const auto check = [&](const auto& images, const std::vector<Vec2i>& sizes_px, const char* what) {
      const std::string wrong = wrong_images(images, sizes_px, what);
      if (!wrong.empty())
        throw Error("can't record to '" + path_ + "': frame " + std::to_string(frame.tick) + " has " + wrong);
    };
    check(frame.silhouettes, sizes_px_, "masks");
    check(frame.alphas, sizes_px_, "matting images");
    check(frame.colors, sizes_px_, "photographs");
    check(frame.depths_m, depth_sizes_px_, "depth images");
  }
  begin_chunk(chunk_of(next), chunk_);
  put_bytes(chunk_, frame.tick);
  put_bytes(chunk_, frame.time_s);
  put_bytes(chunk_, frame.captured_s);
  put_bytes(chunk_, frame.truth_volume_m3.value_or(std::numeric_limits<double>::quiet_NaN()));
  const std::string_view text = std::string_view(status).substr(0, kMostStatusBytes);
  put_bytes(chunk_, static_cast<std::uint32_t>(text.size()));
  chunk_ += text;
  const auto put_all = [this](const auto& images) {
    put_bytes(chunk_, static_cast<std::uint32_t>(images.size()));
    for (const auto& image : images) coder_.put(image, chunk_);
  };
  if (next == NextFrame::success) {
    put_all(frame.silhouettes);
    put_all(frame.alphas);
    put_all(frame.colors);
    put_all(frame.depths_m);
  }
  write_chunk();
}

void RecordingWriter::finish() {
  begin_chunk(RecordingChunk::end, chunk_);
  write_chunk();
  if (::fsync(fd_) != 0) throw Error("can't write '" + path_ + "': " + system_reason());
}

RecordingReader::RecordingReader(const std::string& path) : path_(path) {
  const auto fail = [this](const std::string& why) {
    if (fd_ >= 0) ::close(fd_);
    throw Error("can't read recording '" + printable(path_) + "': " + why);
  };
  fd_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd_ < 0) fail(system_reason());
  struct stat status {};
  if (::fstat(fd_, &status) != 0 || !S_ISREG(status.st_mode)) fail("not a regular file");
  file_bytes_ = static_cast<std::uint64_t>(status.st_size);
  const std::size_t start_bytes = kRecordingMagic.size() + sizeof kRecordingVersion;
  if (!read_at(0, start_bytes, head_) || !head_.starts_with(kRecordingMagic))
    fail("it is none; 'tactus run SCENE --record FILE' makes them");
  ByteReader start(std::string_view(head_).substr(kRecordingMagic.size()));
  if (const auto version = start.take<std::uint32_t>(); version != kRecordingVersion)
    fail("it is of version " + std::to_string(version) + ", expected " + std::to_string(kRecordingVersion));
  RecordingChunk kind = RecordingChunk::end;
  if (!read_payload(start_bytes, kind) || kind != RecordingChunk::rig)
    fail("it was cut off before its cameras, or changed");
  ByteReader in(payload_);
  const auto fps = in.take<double>();
  if (std::isfinite(fps) && fps > 0) fps_ = fps;
  try {
    rig_ = take_rig(in);
    find_chunks();
  } catch (const Error& error) {
    fail(error.what());
  }
}

RecordingReader::~RecordingReader() {
  if (fd_ >= 0) ::close(fd_);
}

bool RecordingReader::read_at(std::uint64_t at, std::size_t bytes, std::string& to) const {
  if (at > file_bytes_ || file_bytes_ - at < bytes) return false;
  to.resize(bytes);
  std::size_t done = 0;
  while (done < bytes) {
    const ssize_t n = ::pread(fd_, to.data() + done, bytes - done, static_cast<off_t>(at + done));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    done += static_cast<std::size_t>(n);
  }
  return true;
}

bool RecordingReader::read_payload(std::uint64_t at, RecordingChunk& kind) {
  if (!read_at(at, kHeadBytes, head_)) return false;
  const std::optional<ChunkHead> head = parse_head(head_);
  if (!head) return false;
  kind = head->kind;
  return read_at(at + kHeadBytes, static_cast<std::size_t>(head->bytes), payload_) &&
         fnv1a(payload_) == head->hash;
}

std::uint64_t RecordingReader::next_head(std::uint64_t at) const {
  constexpr std::size_t kWindow = std::size_t{1} << 16;
  std::string magic, window, head;
  put_bytes(magic, kChunkMagic);
  while (at + kHeadBytes <= file_bytes_) {
    const auto bytes = static_cast<std::size_t>(std::min<std::uint64_t>(kWindow, file_bytes_ - at));
    if (!read_at(at, bytes, window)) break;
    for (std::size_t k = window.find(magic); k != window.npos; k = window.find(magic, k + 1)) {
      const std::uint64_t here = at + k;
      const std::optional<ChunkHead> found =
          read_at(here, kHeadBytes, head) ? parse_head(head) : std::optional<ChunkHead>();
      if (found && found->bytes <= file_bytes_ - here - kHeadBytes) return here;
    }
    if (bytes < kWindow) break;
    at += kWindow - magic.size() + 1;  // a magic may lie across two windows
  }
  return file_bytes_;
}

void RecordingReader::note_damage(const std::string& what) {
  constexpr std::size_t kMostText = 500;
  if (damage_.size() < kMostText) damage_ += (damage_.empty() ? "" : "; ") + what;
}

/// Heads alone: an hour of eight cameras is 108,000 of them.
void RecordingReader::find_chunks() {
  std::uint64_t at = kRecordingMagic.size() + sizeof kRecordingVersion;
  bool closed = false;
  for (std::int64_t chunk = 0; !closed && at < file_bytes_; ++chunk) {
    std::optional<ChunkHead> head;
    if (read_at(at, kHeadBytes, head_)) head = parse_head(head_);
    const bool is_whole = head && head->bytes <= file_bytes_ - at - kHeadBytes;
    if (!is_whole) {
      const std::uint64_t next = next_head(at + 1);
      if (next == file_bytes_) break;
      note_damage("chunk " + std::to_string(chunk) + " at byte " + std::to_string(at) +
                  " has a damaged head: " + std::to_string(next - at) + " bytes are lost");
      places_.push_back(at);
      at = next;
      continue;
    }
    closed = head->kind == RecordingChunk::end;
    if (is_frame(head->kind)) {
      if (places_.size() == kMostFrames)
        throw Error("it has more than " + std::to_string(kMostFrames) + " frames");
      places_.push_back(at);
    }
    at += kHeadBytes + head->bytes;
  }
  if (!closed)
    note_damage("it was cut off after " + std::to_string(places_.size()) + " frames, at byte " +
                std::to_string(at));
  else if (at < file_bytes_)
    note_damage(std::to_string(file_bytes_ - at) + " bytes follow its end, at byte " + std::to_string(at));
}

NextFrame RecordingReader::read(int i, const Wanted& wanted, FrameSet& frame, std::string& status) {
  RecordingChunk kind = RecordingChunk::end;
  if (!read_payload(places_[static_cast<std::size_t>(i)], kind) || !parse(wanted, frame, status)) {
    status = "frame " + std::to_string(i) + " of recording '" + printable(path_) + "', at byte " +
             std::to_string(places_[static_cast<std::size_t>(i)]) + ", is damaged";
    note_damage(status);
    if (!ImageCoder::missing().empty()) status += ", or packed: this program was built without LZ4";
    return NextFrame::bad_frame;
  }
  if (kind == RecordingChunk::bad) return NextFrame::bad_frame;
  if (kind == RecordingChunk::nothing) return NextFrame::nothing_new;
  if (frame.silhouettes.size() == rig_.cameras.size()) return NextFrame::success;
  status = "frame " + std::to_string(i) + " of recording '" + printable(path_) + "' has no silhouettes";
  return NextFrame::bad_frame;
}

bool RecordingReader::parse(const Wanted& wanted, FrameSet& frame, std::string& status) {
  ByteReader in(payload_);
  frame.tick = in.take<std::int64_t>();
  frame.time_s = in.take<double>();
  in.take<double>();     // when it was captured, on a clock that is gone
  frame.captured_s = 0;  // so: as it comes
  const auto truth = in.take<double>();
  frame.truth_volume_m3 = std::isfinite(truth) ? std::optional<double>(truth) : std::nullopt;
  status = printable(in.take(in.take<std::uint32_t>()));
  if (in.failed() || !std::isfinite(frame.time_s)) return false;
  if (in.left() == 0) return true;  // no images
  const auto take_all = [&](const std::vector<Camera>& cameras, auto& images, bool keep) {
    const auto count = in.take<std::uint32_t>();
    if (in.failed() || (count != 0 && count != cameras.size())) return false;
    images.resize(keep ? count : 0);
    for (std::size_t c = 0; c < count; ++c) {
      const Vec2i size_px{cameras[c].width_px, cameras[c].height_px};
      if (!(keep ? coder_.take(in, size_px, images[c]) : ImageCoder::skip(in))) return false;
    }
    return true;
  };
  return take_all(rig_.cameras, frame.silhouettes, true) &&
         take_all(rig_.cameras, frame.alphas, wanted.alphas) &&
         take_all(rig_.cameras, frame.colors, wanted.colors) &&
         take_all(rig_.depth_cameras, frame.depths_m, wanted.depth);
}

}  // namespace tactus
