#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/contact/active_wall_kernels.h"
#include "tactus/contact/copy_kernels.h"
#include "tactus/contact/find_kernels.h"
#include "tactus/contact/fit_kernels.h"
#include "tactus/contact/near_wall_kernels.h"
#include "tactus/contact/pair_bound_kernels.h"
#include "tactus/contact/pair_cut_kernels.h"
#include "tactus/contact/pair_find_kernels.h"
#include "tactus/contact/pair_response_kernels.h"
#include "tactus/contact/paper_kernels.h"
#include "tactus/contact/sample_kernels.h"
#include "tactus/contact/surface_report.h"
#include "tactus/contact/wall_find_kernels.h"
#include "tactus/contact/wall_grid_kernels.h"

TACTUS_CUDA_KERNEL(tactus::TriangleCuts);
TACTUS_CUDA_KERNEL(tactus::TriangleSamples);
TACTUS_CUDA_KERNEL(tactus::SampleLabels);
TACTUS_CUDA_KERNEL(tactus::SampleLeaders);
TACTUS_CUDA_KERNEL(tactus::LimitCount);
TACTUS_CUDA_KERNEL(tactus::LimitSum);
TACTUS_CUDA_KERNEL(tactus::MergeSamples);
TACTUS_CUDA_KERNEL(tactus::NearRows);
TACTUS_CUDA_KERNEL(tactus::PieceStart);
TACTUS_CUDA_KERNEL(tactus::HangOnLowest);
TACTUS_CUDA_KERNEL(tactus::JoinCorners);
TACTUS_CUDA_KERNEL(tactus::CountPieceSamples);
TACTUS_CUDA_KERNEL(tactus::ChoosePieces);
TACTUS_CUDA_KERNEL(tactus::NumberSamples);
TACTUS_CUDA_KERNEL(tactus::SortTriangles);
TACTUS_CUDA_KERNEL(tactus::PiecePartSums);
TACTUS_CUDA_KERNEL(tactus::KeepPoints);
TACTUS_CUDA_KERNEL(tactus::FitBegin);
TACTUS_CUDA_KERNEL(tactus::FitPoints);
TACTUS_CUDA_KERNEL(tactus::FitStage<tactus::FirstFitStep>);
TACTUS_CUDA_KERNEL(tactus::FitStage<tactus::FitStep>);
TACTUS_CUDA_KERNEL(tactus::FitStage<tactus::ChooseMotion>);
TACTUS_CUDA_KERNEL(tactus::NoteReport);
TACTUS_CUDA_KERNEL(tactus::PoseSurface);
TACTUS_CUDA_KERNEL(tactus::DeepRescue);
TACTUS_CUDA_KERNEL(tactus::WakePoints);
TACTUS_CUDA_KERNEL(tactus::FindContacts);
TACTUS_CUDA_KERNEL(tactus::WeighPoints);
TACTUS_CUDA_KERNEL(tactus::FindNearWalls);
TACTUS_CUDA_KERNEL(tactus::PoseActiveVertices);
TACTUS_CUDA_KERNEL(tactus::WatchNodes);
TACTUS_CUDA_KERNEL(tactus::StartActive);
TACTUS_CUDA_KERNEL(tactus::PoseInactiveVertices);
TACTUS_CUDA_KERNEL(tactus::ChooseActive);
TACTUS_CUDA_KERNEL(tactus::GuardCells);
TACTUS_CUDA_KERNEL(tactus::NoteNodes);
TACTUS_CUDA_KERNEL(tactus::CopyWallVertices);
TACTUS_CUDA_KERNEL(tactus::AddWallImpulses);
TACTUS_CUDA_KERNEL(tactus::MarkCells);
TACTUS_CUDA_KERNEL(tactus::SpreadMarks);
TACTUS_CUDA_KERNEL(tactus::ListNearTriangles);
TACTUS_CUDA_KERNEL(tactus::PoseNearTriangles);
TACTUS_CUDA_KERNEL(tactus::NodeMasses);
TACTUS_CUDA_KERNEL(tactus::SetPoints);
TACTUS_CUDA_KERNEL(tactus::FindBodyWalls);
TACTUS_CUDA_KERNEL(tactus::ChooseNearParticles);
TACTUS_CUDA_KERNEL(tactus::WeighRows);
TACTUS_CUDA_KERNEL(tactus::PushVertices);
TACTUS_CUDA_KERNEL(tactus::PushCorners);
TACTUS_CUDA_KERNEL(tactus::PushListedCorners);
TACTUS_CUDA_KERNEL(tactus::GatherAtNodes);
TACTUS_CUDA_KERNEL(tactus::PushNodes);
TACTUS_CUDA_KERNEL(tactus::ApplyContacts);
TACTUS_CUDA_KERNEL(tactus::SumRecords);
TACTUS_CUDA_KERNEL(tactus::SetCaptureTime);
TACTUS_CUDA_KERNEL(tactus::CopyElements<tactus::Vec3f>);
TACTUS_CUDA_KERNEL(tactus::CopyElements<tactus::Vec3i>);
TACTUS_CUDA_KERNEL(tactus::BoundPatches);
TACTUS_CUDA_KERNEL(tactus::BoundBodies);
TACTUS_CUDA_KERNEL(tactus::BoundCubes);
TACTUS_CUDA_KERNEL(tactus::FindPairs);
TACTUS_CUDA_KERNEL(tactus::PairImpulses);
TACTUS_CUDA_KERNEL(tactus::SetSolidCubes);
TACTUS_CUDA_KERNEL(tactus::SetPairPoints);
TACTUS_CUDA_KERNEL(tactus::WeighPairs);
TACTUS_CUDA_KERNEL(tactus::PlaceCubes);
TACTUS_CUDA_KERNEL(tactus::StartPatches);
TACTUS_CUDA_KERNEL(tactus::MovePairs);
TACTUS_CUDA_KERNEL(tactus::PaperVolumes);
TACTUS_CUDA_KERNEL(tactus::PaperContact);
