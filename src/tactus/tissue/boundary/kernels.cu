#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/tissue/boundary/load_kernels.h"
#include "tactus/tissue/boundary/motion_kernels.h"
#include "tactus/tissue/boundary/pull_kernels.h"

TACTUS_CUDA_KERNEL(tactus::boundary::StepMotions);
TACTUS_CUDA_KERNEL(tactus::boundary::ClearImpulses);
TACTUS_CUDA_KERNEL(tactus::boundary::MoveDriven);
TACTUS_CUDA_KERNEL(tactus::boundary::StepLoads);
TACTUS_CUDA_KERNEL(tactus::boundary::LoadCubes);
TACTUS_CUDA_KERNEL(tactus::boundary::GatherLoads);
TACTUS_CUDA_KERNEL(tactus::boundary::PullNodes);
