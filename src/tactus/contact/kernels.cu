#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/contact/motion_kernels.h"
#include "tactus/contact/response_kernels.h"
#include "tactus/contact/sample_kernels.h"

TACTUS_CUDA_KERNEL(tactus::TrianglePieces);
TACTUS_CUDA_KERNEL(tactus::TriangleSamples);
TACTUS_CUDA_KERNEL(tactus::SampleLabels);
TACTUS_CUDA_KERNEL(tactus::SampleLeaders);
TACTUS_CUDA_KERNEL(tactus::LimitCount);
TACTUS_CUDA_KERNEL(tactus::MergeSamples);
TACTUS_CUDA_KERNEL(tactus::KeepPrevious);
TACTUS_CUDA_KERNEL(tactus::CentroidParts);
TACTUS_CUDA_KERNEL(tactus::GuessMotion);
TACTUS_CUDA_KERNEL(tactus::FitPoints);
TACTUS_CUDA_KERNEL(tactus::FitParts);
TACTUS_CUDA_KERNEL(tactus::NoteStill);
TACTUS_CUDA_KERNEL(tactus::NoteGuess);
TACTUS_CUDA_KERNEL(tactus::FitStep);
TACTUS_CUDA_KERNEL(tactus::ChooseMotion);
TACTUS_CUDA_KERNEL(tactus::PoseSurface);
TACTUS_CUDA_KERNEL(tactus::DeepRescue);
TACTUS_CUDA_KERNEL(tactus::ContactResponse);
TACTUS_CUDA_KERNEL(tactus::TotalsParts);
TACTUS_CUDA_KERNEL(tactus::AddTotals);
