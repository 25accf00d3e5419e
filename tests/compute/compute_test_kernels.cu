#include "compute/compute_test_kernels.h"
#include "tactus/base/math.h"
#include "tactus/compute/cuda/kernel_launch.cuh"

TACTUS_CUDA_KERNEL(tactus::test::Affine);
TACTUS_CUDA_KERNEL(tactus::test::ReverseRuns);
TACTUS_CUDA_KERNEL(tactus::test::Shuffle);
TACTUS_CUDA_KERNEL(tactus::test::ShuffleRuns);
TACTUS_CUDA_CHAIN(tactus::test::Shuffle, tactus::test::ShuffleRuns, tactus::test::Shuffle);
