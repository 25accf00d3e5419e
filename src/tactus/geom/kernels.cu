#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/geom/cell_list_kernels.h"

TACTUS_CUDA_KERNEL(tactus::CellKeys);
TACTUS_CUDA_KERNEL(tactus::CellBounds);
