#pragma once
/// Sets of images of a rig in one file, readable up to the place where a crash cut it. docs/recording.md has
/// the format.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tactus/rig/sources/frame_source.h"
#include "tactus/rig/wire/image_coder.h"

namespace tactus {

/// Kinds of chunks. Others are stepped over.
enum class RecordingChunk : std::uint32_t {
  rig = 1,      ///< the first: cameras, workspace
  set = 2,      ///< images of one tick
  nothing = 3,  ///< a frame without new images
  bad = 4,      ///< a tick that no camera delivered
  end = 5,      ///< the recording was closed; missing after a crash
};

inline constexpr std::string_view kRecordingMagic = "TACTUSRC";
/// Whether a file begins as a recording does; false for one that can't be opened.
bool is_recording(const std::string& path);

/// A chunk as it stands in the file: a head with length and hashes, and the payload.
std::string recording_chunk(RecordingChunk kind, std::string_view payload);
/// Begins a file.
std::string recording_start();

/// Writes sets as they are released. Each is one write to the system, so once `add` has returned, the set
/// survives the end of this process, however it ends; the system's own end costs the sets that it had not yet
/// put on the disk.
class RecordingWriter {
 public:
  /// @param fps of the rig; none where frames have no times
  /// @throws Error when the file can't be made, or is there and not empty: a recording is not overwritten.
  RecordingWriter(const std::string& path, const Rig& rig, std::optional<double> fps);
  ~RecordingWriter();
  RecordingWriter(const RecordingWriter&) = delete;
  RecordingWriter& operator=(const RecordingWriter&) = delete;

  /// @param next the source's answer; `no_more_data` is not written
  /// @param status of the source
  /// @throws Error naming the file (disk full, for example), or a frame that no reader would take: without a
  /// finite time, with images too few, or of other sizes than its cameras'.
  void add(NextFrame next, const FrameSet& frame, const std::string& status);
  /// Says in the file that it is whole, and waits for the disk. @throws Error.
  void finish();

 private:
  void write_chunk();
  void write(std::string_view bytes);
  std::string path_, chunk_;
  std::vector<Vec2i> sizes_px_, depth_sizes_px_;  ///< per camera
  int fd_ = -1;
  ImageCoder coder_;
};

/// Reads a recording set by set. Memory is bounded by the sets, not by the file.
class RecordingReader {
 public:
  /// Images of a set that are wanted beside its silhouettes.
  struct Wanted {
    bool alphas = true, colors = true, depth = true;
  };
  /// Looks at the heads of all chunks. @throws Error naming the file and the fault of its head or rig.
  explicit RecordingReader(const std::string& path);
  ~RecordingReader();
  RecordingReader(const RecordingReader&) = delete;
  RecordingReader& operator=(const RecordingReader&) = delete;

  const Rig& rig() const { return rig_; }
  std::optional<double> fps() const { return fps_; }
  /// Sets, frames without new images, and bad ticks.
  int count() const { return static_cast<int>(places_.size()); }
  /// "" when it was closed and all heads of its chunks are whole; else the damage, with offsets: "it was cut
  /// off after 299 frames, at byte 1234". Chunks that follow a damaged head are found again; each such place
  /// is one bad frame.
  const std::string& damage() const { return damage_; }
  /// Reads frame `i` of count(). A damaged one is a bad frame, and `status` says so, with its number and
  /// offset. @param status of the source at that frame
  NextFrame read(int i, const Wanted& wanted, FrameSet& frame, std::string& status);

 private:
  void find_chunks();
  /// @returns where the next whole head begins, from `at` on; the end of the file where none does.
  std::uint64_t next_head(std::uint64_t at) const;
  void note_damage(const std::string& what);
  /// @returns whether all of it is in the file.
  bool read_at(std::uint64_t at, std::size_t bytes, std::string& to) const;
  /// Reads the payload of the chunk there. @returns whether it agrees with its hash.
  bool read_payload(std::uint64_t at, RecordingChunk& kind);
  bool parse(const Wanted& wanted, FrameSet& frame, std::string& status);
  std::string path_, head_, payload_, damage_;
  int fd_ = -1;
  std::uint64_t file_bytes_ = 0;
  Rig rig_;
  std::optional<double> fps_;
  std::vector<std::uint64_t> places_;  ///< of the chunks of frames, and of heads that are damaged
  ImageCoder coder_;
};

}  // namespace tactus
