#include "frame/schedule_test_kernels.h"

#include "tactus/compute/cuda/kernel_launch.cuh"

TACTUS_CUDA_KERNEL(tactus::DoubleAndAdd);
TACTUS_CUDA_KERNEL(tactus::SumDevices);
