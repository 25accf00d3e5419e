#include "tactus/base/vec.h"
#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/multi_device/halo_kernels.h"
#include "tactus/multi_device/peer_trial_kernels.h"

TACTUS_CUDA_KERNEL(tactus::ReadPeer);

/// The fields that Halo is used with.
#define TACTUS_CUDA_HALO(T, kFields)                \
  TACTUS_CUDA_KERNEL(tactus::PullHalo<T, kFields>); \
  TACTUS_CUDA_KERNEL(tactus::AddHalo<T, kFields>);  \
  TACTUS_CUDA_KERNEL(tactus::PoisonHalo<T, kFields>)

TACTUS_CUDA_HALO(float, 1);
TACTUS_CUDA_HALO(float, 3);
TACTUS_CUDA_HALO(float, 6);
TACTUS_CUDA_HALO(tactus::Index, 1);
TACTUS_CUDA_HALO(tactus::Vec3f, 2);
