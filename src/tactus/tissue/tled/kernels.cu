#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/tissue/tled/virtual_element_kernels.h"

namespace tactus::tled {
template <class Law, class Tiles>
struct KernelsOf {
  using Store = ElementForces<OnePointCube<Law>, Tiles, StoreForces>;
  using Move = ElementForces<OnePointCube<Law>, Tiles, MoveNodes>;
  using StoreFull = ElementForces<EightPointCube<Law>, Tiles, StoreForces>;
  using MoveFull = ElementForces<EightPointCube<Law>, Tiles, MoveNodes>;
  using StoreRelaxing = ElementForces<RelaxingCube<Law, 1>, Tiles, StoreForces>;
  using MoveRelaxing = ElementForces<RelaxingCube<Law, 1>, Tiles, MoveNodes>;
  using StoreRelaxing2 = ElementForces<RelaxingCube<Law, 2>, Tiles, StoreForces>;
  using MoveRelaxing2 = ElementForces<RelaxingCube<Law, 2>, Tiles, MoveNodes>;
};
template <class Law>
using OnCpu = KernelsOf<Law, TilesOnCpu>;
template <class Law>
using OnGpu = KernelsOf<Law, TilesOnGpu>;
}  // namespace tactus::tled

#define TACTUS_ROW_ON(LAW, ON)                                       \
  TACTUS_CUDA_KERNEL(tactus::tled::ON<tactus::LAW>::Store);          \
  TACTUS_CUDA_KERNEL(tactus::tled::ON<tactus::LAW>::Move);           \
  TACTUS_CUDA_KERNEL(tactus::tled::ON<tactus::LAW>::StoreFull);      \
  TACTUS_CUDA_KERNEL(tactus::tled::ON<tactus::LAW>::MoveFull);       \
  TACTUS_CUDA_KERNEL(tactus::tled::ON<tactus::LAW>::StoreRelaxing);  \
  TACTUS_CUDA_KERNEL(tactus::tled::ON<tactus::LAW>::MoveRelaxing);   \
  TACTUS_CUDA_KERNEL(tactus::tled::ON<tactus::LAW>::StoreRelaxing2); \
  TACTUS_CUDA_KERNEL(tactus::tled::ON<tactus::LAW>::MoveRelaxing2);
#define TACTUS_ROW(WORD, LAW)                                                               \
  TACTUS_ROW_ON(LAW, OnCpu)                                                                 \
  TACTUS_ROW_ON(LAW, OnGpu)                                                                 \
  TACTUS_CUDA_KERNEL(tactus::tled::CopyForces<tactus::tled::OnePointCube<tactus::LAW>>);    \
  TACTUS_CUDA_KERNEL(tactus::tled::CopyForces<tactus::tled::EightPointCube<tactus::LAW>>);  \
  TACTUS_CUDA_KERNEL(tactus::tled::CopyForces<tactus::tled::RelaxingCube<tactus::LAW, 1>>); \
  TACTUS_CUDA_KERNEL(tactus::tled::CopyForces<tactus::tled::RelaxingCube<tactus::LAW, 2>>);

TACTUS_CUDA_KERNEL(tactus::tled::LoadPositions);
TACTUS_CUDA_KERNEL(tactus::tled::LoadNodes);
TACTUS_CUDA_KERNEL(tactus::tled::StoreNodes);
TACTUS_CUDA_KERNEL(tactus::tled::KeepHistory);
TACTUS_MATERIAL_LAWS(TACTUS_ROW)
TACTUS_CUDA_KERNEL(tactus::tled::FindExtremes);
TACTUS_CUDA_KERNEL(tactus::tled::FindCopyCells);
TACTUS_CUDA_KERNEL(tactus::tled::KeyCorners);
TACTUS_CUDA_KERNEL(tactus::tled::FlagFirstCorners);
TACTUS_CUDA_KERNEL(tactus::tled::KeepExternal);
TACTUS_CUDA_KERNEL(tactus::tled::MoveVirtualNodes);
TACTUS_CUDA_KERNEL(tactus::tled::AddVirtualForces);
TACTUS_CUDA_KERNEL(tactus::tled::NoteFirstCorners);
TACTUS_CUDA_KERNEL(tactus::tled::FindCopyExtremes);
