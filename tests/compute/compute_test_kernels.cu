#include "compute/compute_test_kernels.h"
#include "tactus/base/math.h"
#include "tactus/compute/cuda/kernel_launch.cuh"

TACTUS_CUDA_KERNEL(tactus::test::Affine);
TACTUS_CUDA_KERNEL(tactus::test::ReverseRuns);
