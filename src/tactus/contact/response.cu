#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/contact/body_points.h"
#include "tactus/contact/copy_kernels.h"
#include "tactus/contact/find_kernels.h"
#include "tactus/contact/paper_kernels.h"
#include "tactus/contact/response_kernels.h"

TACTUS_CUDA_KERNEL(tactus::PoseSurface);
TACTUS_CUDA_KERNEL(tactus::DeepRescue);
TACTUS_CUDA_KERNEL(tactus::WakePoints);
TACTUS_CUDA_KERNEL(tactus::FindContacts);
TACTUS_CUDA_KERNEL(tactus::WeighPoints);
TACTUS_CUDA_KERNEL(tactus::NodeMasses);
TACTUS_CUDA_KERNEL(tactus::SetPoints);
TACTUS_CUDA_KERNEL(tactus::WeighRows);
TACTUS_CUDA_KERNEL(tactus::ApplyContacts);
TACTUS_CUDA_KERNEL(tactus::SumRecords);
TACTUS_CUDA_KERNEL(tactus::CopyElements<tactus::Vec3f>);
TACTUS_CUDA_KERNEL(tactus::CopyElements<tactus::Vec3i>);
TACTUS_CUDA_KERNEL(tactus::PaperVolumes);
TACTUS_CUDA_KERNEL(tactus::PaperContact);
