#include "tactus/io/labels/label_file.h"

#include <cstring>
#include <string_view>

#include "tactus/base/error.h"
#include "tactus/io/labels/label_voxels.h"
#include "tactus/io/mesh/mesh_file.h"

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

enum class Format : std::uint8_t { none, inr, nifti, nrrd, meta_image, dicom };

Format format_of(const std::string& path) {
  char bytes[1024];
  const std::string_view head(bytes, LabelBytes(path).read(bytes, sizeof bytes));
  if (head.empty()) throw Error(path + ": the file is empty");
  if (head.starts_with("#INRIMAGE-4#{")) return Format::inr;
  if (is_nifti(head)) return Format::nifti;
  if (head.starts_with("NRRD000")) return Format::nrrd;
  if (is_meta_image(head)) return Format::meta_image;
  return is_dicom(head) ? Format::dicom : Format::none;
}

}  // namespace

bool is_label_volume(const std::string& path) { return format_of(path) != Format::none; }

LabelVolume read_label_volume(const std::string& path) {
  switch (format_of(path)) {
    case Format::inr:
      return read_inr(path);
    case Format::nifti:
      return read_nifti(path);
    case Format::nrrd:
      return read_nrrd(path);
    case Format::meta_image:
      return read_meta_image(path);
    case Format::dicom:
      throw Error(path +
                  ": a DICOM file, which is not read; a segmentation becomes NIfTI by 'segimage2itkimage "
                  "--outputType nii' (dcmqi) or in 3D Slicer, a series of images by 'dcm2niix'");
    case Format::none:
      break;
  }
  throw Error(path + ": no label volume, expected " + kLabelFormats +
              (is_mesh_path(path) ? "; a mesh is a body's shape with 'kind: mesh'" : ""));
}

}  // namespace tactus
