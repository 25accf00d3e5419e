#include "multi_device/halo_test_kernels.h"
#include "tactus/compute/cuda/kernel_launch.cuh"

TACTUS_CUDA_KERNEL(tactus::test::Diffuse);
TACTUS_CUDA_KERNEL(tactus::test::Clear);
TACTUS_CUDA_KERNEL(tactus::test::AddElements);
