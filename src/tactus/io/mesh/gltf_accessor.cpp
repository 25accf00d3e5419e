#include "tactus/io/mesh/gltf_accessor.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace tactus::mesh_reading {
namespace {

template <class T>
T load(const unsigned char* p) {
  T value;
  std::memcpy(&value, p, sizeof value);
  return value;
}

/// The size of a component; 0 for types that glTF doesn't have (the parser knows signed integers and doubles,
/// too).
std::size_t bytes_of(int type) {
  if (type == TINYGLTF_COMPONENT_TYPE_INT || type == TINYGLTF_COMPONENT_TYPE_DOUBLE) return 0;
  return static_cast<std::size_t>(
      std::max(tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(type)), 0));
}

}  // namespace

GltfAccessor::GltfAccessor(const std::string& path, const tinygltf::Model& model, int index, const char* what,
                           int components)
    : path_(path), name_(std::string(what) + " (accessor " + std::to_string(index) + ")") {
  const auto& a = gltf_item(path, model.accessors, index, "accessor");
  if (tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(a.type)) != components)
    throw Error(path + ": " + name_ + " has a wrong type, expected " + std::to_string(components) +
                " components");
  type_ = a.componentType;
  normalized_ = a.normalized;
  count_ = a.count;
  component_ = bytes_of(type_);
  element_ = component_ * static_cast<std::size_t>(components);
  stride_ = element_;
  if (a.bufferView >= 0) {
    const int stride = a.ByteStride(gltf_item(path, model.bufferViews, a.bufferView, "buffer view"));
    if (stride <= 0) component_ = 0;
    stride_ = static_cast<std::size_t>(std::max(stride, 0));
  }
  if (component_ == 0) throw Error(path + ": " + name_ + " has an unknown component type or a bad stride");
  if (a.bufferView >= 0)
    data_ = inside(model, a.bufferView, static_cast<std::int64_t>(a.byteOffset), count_, element_, stride_);
  if (a.sparse.isSparse) read_sparse(model, a);
}

const unsigned char* GltfAccessor::inside(const tinygltf::Model& model, int view, std::int64_t offset,
                                          std::size_t count, std::size_t size, std::size_t stride) const {
  const auto& v = gltf_item(path_, model.bufferViews, view, "buffer view");
  const auto& buffer = gltf_item(path_, model.buffers, v.buffer, "buffer");
  // Subtractions only: sums of a damaged file's numbers could wrap around.
  const std::size_t end = buffer.data.size();
  const bool starts =
      v.byteOffset <= end && offset >= 0 && static_cast<std::size_t>(offset) <= end - v.byteOffset;
  const std::size_t begin = starts ? v.byteOffset + static_cast<std::size_t>(offset) : 0;
  if (!starts || (count > 0 && (size > end - begin || count - 1 > (end - begin - size) / stride)))
    throw Error(path_ + ": " + name_ + " reaches beyond its buffer of " + std::to_string(end) + " bytes");
  return buffer.data.data() + begin;
}

void GltfAccessor::read_sparse(const tinygltf::Model& model, const tinygltf::Accessor& a) {
  const auto& sparse = a.sparse;
  const std::size_t size = sparse.indices.componentType == TINYGLTF_COMPONENT_TYPE_FLOAT
                               ? 0
                               : bytes_of(sparse.indices.componentType);
  if (sparse.count < 0 || size == 0 || size > 4)
    throw Error(path_ + ": " + name_ + " is sparse with " + std::to_string(sparse.count) +
                " values and indices of type " + std::to_string(sparse.indices.componentType) +
                ", expected 5121, 5123 or 5125");
  const auto n = static_cast<std::size_t>(sparse.count);
  const unsigned char* indices =
      inside(model, sparse.indices.bufferView, sparse.indices.byteOffset, n, size, size);
  values_ = inside(model, sparse.values.bufferView, sparse.values.byteOffset, n, element_, element_);
  replaced_.reserve(n);
  for (std::size_t k = 0; k < n; ++k) {
    std::uint32_t i = 0;
    std::memcpy(&i, indices + k * size, size);
    if (i >= count_ || (k > 0 && i <= replaced_.back()))
      throw Error(path_ + ": " + name_ + " is sparse and replaces element " + std::to_string(i) + " of " +
                  std::to_string(count_) + ", expected growing numbers below that");
    replaced_.push_back(i);
  }
}

bool GltfAccessor::whole_numbers() const { return type_ != TINYGLTF_COMPONENT_TYPE_FLOAT; }

double GltfAccessor::operator()(std::size_t i, std::size_t c) const {
  const unsigned char* element = data_ == nullptr ? nullptr : data_ + i * stride_;
  if (!replaced_.empty()) {
    const auto found = std::lower_bound(replaced_.begin(), replaced_.end(), i);
    if (found != replaced_.end() && *found == i)
      element = values_ + static_cast<std::size_t>(found - replaced_.begin()) * element_;
  }
  if (element == nullptr) return 0;
  const unsigned char* p = element + c * component_;
  switch (type_) {
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return load<std::uint8_t>(p) / (normalized_ ? 255. : 1.);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return load<std::uint16_t>(p) / (normalized_ ? 65535. : 1.);
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return normalized_ ? std::max(load<std::int8_t>(p) / 127., -1.) : load<std::int8_t>(p);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return normalized_ ? std::max(load<std::int16_t>(p) / 32767., -1.) : load<std::int16_t>(p);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return load<std::uint32_t>(p);
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return static_cast<double>(load<float>(p));
    default:
      return std::nan("");
  }
}

}  // namespace tactus::mesh_reading
