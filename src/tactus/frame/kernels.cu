#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/frame/frame_params.h"
#include "tactus/frame/readback_kernels.h"

TACTUS_CUDA_KERNEL(tactus::EndBlock);
TACTUS_CUDA_KERNEL(tactus::GatherRecords);
