#pragma once
/// Whether a video is whole.
#include <string>

namespace tactus {

/// Walks the boxes of an MP4 (ISO/IEC 14496-12): they fill the file exactly, the index (`moov`) is there, and
/// its sample table counts `frames`. An encoder that met a full disk leaves a file without an index.
/// @returns the fault; "" for a whole file.
std::string what_is_wrong_with_mp4(int fd, int frames);

}  // namespace tactus
