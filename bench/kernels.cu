#include "affine_kernel.h"
#include "search_kernels.h"
#include "tactus/compute/cuda/kernel_launch.cuh"

TACTUS_CUDA_KERNEL(tactus::bench::AffineKernel);
TACTUS_CUDA_KERNEL(tactus::bench::ZIndex);
TACTUS_CUDA_KERNEL(tactus::bench::GatherSorted);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::bench::DensityPass>);
