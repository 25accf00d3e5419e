#include "geom/cell_list_test_kernels.h"
#include "tactus/compute/cuda/kernel_launch.cuh"

TACTUS_CUDA_KERNEL(tactus::test::CollectNear);
