#pragma once
/// Label volumes from files.
#include <string>

#include "tactus/geom/lattice/label_volume.h"

namespace tactus {

/// Reads a label volume, whose format is found by content: NIfTI-1 and -2 in one file (.nii, .nii.gz), NRRD
/// (.nrrd, .seg.nrrd; .nhdr beside its data), MetaImage (.mha; .mhd beside its data) and INRIMAGE-4 (.inr,
/// .inr.gz). Labels are whole numbers from 0 to 65535, stored as any integer or real type. Coordinates are
/// the scanner's, in metres: x to the patient's right, y to the front, z to the head. A file that gives only
/// the size of its voxels has its lowest corner at the origin.
/// @throws Error naming the file and the fault: unreadable, no regular file, header field, several volumes,
/// truncated, damaged, no labels, sheared; DICOM, with the programs that convert it.
LabelVolume read_label_volume(const std::string& path);

/// Whether a file begins as one of those, or as DICOM. @throws Error: unreadable.
bool is_label_volume(const std::string& path);
/// The formats and their endings, for messages.
inline constexpr const char* kLabelFormats =
    "NIfTI (.nii, .nii.gz), NRRD (.nrrd), MetaImage (.mha, .mhd) or INRIMAGE-4 (.inr, .inr.gz)";

}  // namespace tactus
