#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/frame/frame_params.h"

TACTUS_CUDA_KERNEL(tactus::NextSubstep);
