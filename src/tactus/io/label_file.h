#pragma once
/// Label volumes from files.
#include <string>

#include "tactus/geom/label_volume.h"

namespace tactus {

/// Reads an INRIMAGE-4 volume of one unsigned byte a voxel, plain (.inr) or compressed (.inr.gz). The file's
/// voxel sizes are millimetres. The volume's lowest corner is the origin.
/// @throws Error naming the file and what is wrong: unreadable, header field, truncated, damaged.
LabelVolume read_label_volume(const std::string& path);

}  // namespace tactus
