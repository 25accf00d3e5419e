#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/tissue/flsm/near_kernels.h"

TACTUS_CUDA_KERNEL(tactus::flsm::LoadNodes);
TACTUS_CUDA_KERNEL(tactus::flsm::RowSums);
TACTUS_CUDA_KERNEL(tactus::flsm::SlideSums);
TACTUS_CUDA_KERNEL(tactus::flsm::NearSums);
TACTUS_CUDA_KERNEL(tactus::flsm::CorrectSums);
TACTUS_CUDA_KERNEL(tactus::flsm::FitRegions);
TACTUS_CUDA_KERNEL(tactus::flsm::SlideGoals);
TACTUS_CUDA_KERNEL(tactus::flsm::RowGoals);
TACTUS_CUDA_KERNEL(tactus::flsm::NearGoals);
TACTUS_CUDA_KERNEL(tactus::flsm::CorrectGoals);
TACTUS_CUDA_KERNEL(tactus::flsm::Integrate);
