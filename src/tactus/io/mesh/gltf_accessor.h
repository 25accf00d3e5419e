#pragma once
/// The numbers of a glTF file. Internal to io.
#include <tiny_gltf.h>

#include <string>
#include <vector>

#include "tactus/base/error.h"
#include "tactus/base/vec.h"

namespace tactus::mesh_reading {

/// Item i of a list of a glTF file. @throws Error naming the file where there is none.
template <class T>
const T& gltf_item(const std::string& path, const std::vector<T>& items, int i, const char* what) {
  if (i < 0 || static_cast<std::size_t>(i) >= items.size()) {
    throw Error(path + ": refers to " + what + " " + std::to_string(i) + ", but there are " +
                std::to_string(items.size()));
  }
  return items[static_cast<std::size_t>(i)];
}

/// Component c of element i of an accessor, sparse ones too. Without a buffer view, all elements are 0. The
/// model has to outlive it.
class GltfAccessor {
 public:
  /// @throws Error naming the file and the accessor: wrong type, beyond its buffer.
  GltfAccessor(const std::string& path, const tinygltf::Model& model, int index, const char* what,
               int components);
  double operator()(std::size_t i, std::size_t c) const;
  Vec3d vec(std::size_t i) const { return {(*this)(i, 0), (*this)(i, 1), (*this)(i, 2)}; }
  std::size_t count() const { return count_; }
  bool whole_numbers() const;

 private:
  /// `count` elements of `size` bytes in a buffer view, every `stride`; 0: behind each other.
  const unsigned char* inside(const tinygltf::Model& model, int view, std::int64_t offset, std::size_t count,
                              std::size_t size, std::size_t stride) const;
  void read_sparse(const tinygltf::Model& model, const tinygltf::Accessor& accessor);

  const std::string& path_;
  std::string name_;
  std::size_t count_ = 0, stride_ = 0, component_ = 0, element_ = 0;
  int type_ = 0;
  bool normalized_ = false;
  const unsigned char* data_ = nullptr;    ///< none: zeros
  std::vector<std::size_t> replaced_;      ///< sorted elements whose values stand in `values_`
  const unsigned char* values_ = nullptr;  ///< behind each other
};

}  // namespace tactus::mesh_reading
