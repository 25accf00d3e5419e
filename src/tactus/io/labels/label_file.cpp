#include "tactus/io/labels/label_file.h"

#include <cstring>
#include <string_view>

#include "tactus/base/error.h"
#include "tactus/io/labels/label_voxels.h"

namespace tactus {
namespace {

/// A file of DICOM begins with 128 bytes of nothing.
bool is_dicom(std::string_view head) { return head.size() >= 132 && head.substr(128, 4) == "DICM"; }

/// NIfTI begins with the length of its header, in either order of bytes.
bool is_nifti(std::string_view head) {
  if (head.size() < 4) return false;
  std::uint32_t size = 0;
  std::memcpy(&size, head.data(), sizeof size);
  return size == 348 || size == 540 || size == 0x5c010000U || size == 0x1c020000U;
}

/// MetaImage begins with one of these fields.
bool is_meta_image(std::string_view head) {
  for (const std::string_view key : {"ObjectType", "NDims", "Comment"}) {
    if (head.starts_with(key) && head.find("ElementDataFile") != head.npos) return true;
  }
  return head.starts_with("ObjectType");
}

}  // namespace

LabelVolume read_label_volume(const std::string& path) {
  char bytes[1024];
  const std::string_view head(bytes, LabelBytes(path).read(bytes, sizeof bytes));
  if (head.starts_with("#INRIMAGE-4#{")) return read_inr(path);
  if (is_nifti(head)) return read_nifti(path);
  if (head.starts_with("NRRD000")) return read_nrrd(path);
  if (is_meta_image(head)) return read_meta_image(path);
  if (is_dicom(head))
    throw Error(
        path +
        ": a DICOM file, which is not read; a segmentation becomes NIfTI by 'segimage2itkimage --outputType "
        "nii' (dcmqi) or in 3D Slicer, a series of images by 'dcm2niix'");
  throw Error(path +
              ": no label volume, expected NIfTI (.nii, .nii.gz), NRRD (.nrrd), MetaImage (.mha, .mhd) or "
              "INRIMAGE-4 (.inr, .inr.gz)");
}

}  // namespace tactus
