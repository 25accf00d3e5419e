#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/contact/real/component_kernels.h"
#include "tactus/contact/real/fit_kernels.h"
#include "tactus/contact/real/motion_kernels.h"
#include "tactus/contact/real/sample_kernels.h"
#include "tactus/contact/real/surface_report.h"
#include "tactus/contact/surface_triangles.h"

TACTUS_CUDA_KERNEL(tactus::TriangleCuts);
TACTUS_CUDA_KERNEL(tactus::TriangleSamples);
TACTUS_CUDA_KERNEL(tactus::SampleLabels);
TACTUS_CUDA_KERNEL(tactus::SampleReferenceNodes);
TACTUS_CUDA_KERNEL(tactus::LimitCount);
TACTUS_CUDA_KERNEL(tactus::LimitSum);
TACTUS_CUDA_KERNEL(tactus::MergeSamples);
TACTUS_CUDA_KERNEL(tactus::NearRows);
TACTUS_CUDA_KERNEL(tactus::ComponentStart);
TACTUS_CUDA_KERNEL(tactus::HangOnLowest);
TACTUS_CUDA_KERNEL(tactus::JoinCorners);
TACTUS_CUDA_KERNEL(tactus::CountComponentSamples);
TACTUS_CUDA_KERNEL(tactus::ChooseComponents);
TACTUS_CUDA_KERNEL(tactus::NumberSamples);
TACTUS_CUDA_KERNEL(tactus::SortTriangles);
TACTUS_CUDA_KERNEL(tactus::ComponentPartSums);
TACTUS_CUDA_KERNEL(tactus::KeepPoints);
TACTUS_CUDA_KERNEL(tactus::FitBegin);
TACTUS_CUDA_KERNEL(tactus::FitPoints);
TACTUS_CUDA_KERNEL(tactus::FitStage<tactus::FirstFitStep>);
TACTUS_CUDA_KERNEL(tactus::FitStage<tactus::FitStep>);
TACTUS_CUDA_KERNEL(tactus::FitStage<tactus::ChooseMotion>);
TACTUS_CUDA_KERNEL(tactus::NoteReport);
TACTUS_CUDA_KERNEL(tactus::SetCaptureTime);
