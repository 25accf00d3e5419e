// Scan, compaction and sort from CUB.
#include <thrust/iterator/counting_iterator.h>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>
#include <cub/device/device_select.cuh>

#include <algorithm>

#include "tactus/compute/cuda/cuda_backend.h"
#include "tactus/compute/cuda/cuda_check.h"

namespace tactus::cuda {
namespace {

/// Whether index i is below the count, which only the device may know, and its flag is set.
struct IsFlagged {
  const int* flags;
  Count count;
  __device__ bool operator()(int i) const { return i < count.get() && flags[i] != 0; }
};

}  // namespace

std::size_t algorithm_scratch_bytes(int n) {
  std::size_t scan = 0, wide_scan = 0, select = 0, sort = 0;
  cub::DoubleBuffer<unsigned> keys;
  cub::DoubleBuffer<int> values;
  int* none = nullptr;
  std::uint64_t* no_words = nullptr;
  TACTUS_CUDA_CHECK(cub::DeviceScan::ExclusiveSum(nullptr, scan, none, none, n));
  TACTUS_CUDA_CHECK(cub::DeviceScan::ExclusiveSum(nullptr, wide_scan, no_words, no_words, n));
  TACTUS_CUDA_CHECK(cub::DeviceSelect::If(nullptr, select, thrust::counting_iterator<int>(0), none, none, n,
                                          IsFlagged{none, n}));
  TACTUS_CUDA_CHECK(cub::DeviceRadixSort::SortPairs(nullptr, sort, keys, values, n));
  return std::max({scan, wide_scan, select, sort});
}

void exclusive_scan(int ordinal, void* scratch, std::size_t scratch_bytes, const int* in, int* out, int n,
                    void* stream) {
  TACTUS_CUDA_CHECK(cudaSetDevice(ordinal));
  TACTUS_CUDA_CHECK(
      cub::DeviceScan::ExclusiveSum(scratch, scratch_bytes, in, out, n, static_cast<cudaStream_t>(stream)));
}

void exclusive_scan(int ordinal, void* scratch, std::size_t scratch_bytes, const std::uint64_t* in,
                    std::uint64_t* out, int n, void* stream) {
  TACTUS_CUDA_CHECK(cudaSetDevice(ordinal));
  TACTUS_CUDA_CHECK(
      cub::DeviceScan::ExclusiveSum(scratch, scratch_bytes, in, out, n, static_cast<cudaStream_t>(stream)));
}

void compact(int ordinal, void* scratch, std::size_t scratch_bytes, const int* flags, int* out,
             int* out_count, Count count, void* stream) {
  TACTUS_CUDA_CHECK(cudaSetDevice(ordinal));
  TACTUS_CUDA_CHECK(cub::DeviceSelect::If(scratch, scratch_bytes, thrust::counting_iterator<int>(0), out,
                                          out_count, count.capacity, IsFlagged{flags, count},
                                          static_cast<cudaStream_t>(stream)));
}

void sort_pairs(int ordinal, void* scratch, std::size_t scratch_bytes, unsigned* keys, int* values,
                unsigned* keys2, int* values2, int n, int key_bits, void* stream) {
  TACTUS_CUDA_CHECK(cudaSetDevice(ordinal));
  cub::DoubleBuffer<unsigned> k(keys, keys2);
  cub::DoubleBuffer<int> v(values, values2);
  const auto s = static_cast<cudaStream_t>(stream);
  TACTUS_CUDA_CHECK(cub::DeviceRadixSort::SortPairs(scratch, scratch_bytes, k, v, n, 0, key_bits, s));
  if (k.Current() != keys) {
    const auto count = static_cast<std::size_t>(n);
    TACTUS_CUDA_CHECK(cudaMemcpyAsync(keys, keys2, count * sizeof(unsigned), cudaMemcpyDeviceToDevice, s));
    TACTUS_CUDA_CHECK(cudaMemcpyAsync(values, values2, count * sizeof(int), cudaMemcpyDeviceToDevice, s));
  }
}

}  // namespace tactus::cuda
