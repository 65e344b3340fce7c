#include "GaussianAvatarDevice.h"

#include "GaussianAvatarKernels.h"
#include "RenderGraphBuilder.h"
#include "RenderGraphUtils.h"

namespace
{
const TCHAR* const BufferName = TEXT("GaussianAvatar");
}

FRDGBufferRef FGaussianAvatarDevice::Find(const avatar_unreal::BufferUse& Use, uint32 Stride)
{
	TRefCountPtr<FRDGPooledBuffer>& Kept = Buffers[Use.id];
	if (Kept.IsValid() && Kept->Desc.GetSize() >= Use.bytes) return Builder->RegisterExternalBuffer(Kept);
	const FRDGBufferRef Made = Make(Use, Stride);
	Kept = Builder->ConvertToExternalBuffer(Made);
	return Made;
}

FRDGBufferRef FGaussianAvatarDevice::Make(const avatar_unreal::BufferUse& Use, uint32 Stride)
{
	const uint32 Count = FMath::Max((Use.bytes + Stride - 1) / Stride, 1u); // graphics interfaces have no empty buffers
	if (Use.source != nullptr && Use.bytes > 0)
	{
		TArray<uint8> Content;
		Content.SetNumZeroed(static_cast<int32>(Count * Stride));
		avatar_buffer_content(Use.source, Use.id.index, Content.GetData());
		return CreateStructuredBuffer(*Builder, BufferName, Stride, Count, Content.GetData(), uint64{Count} * Stride);
	}
	const FRDGBufferRef Made = Builder->CreateBuffer(FRDGBufferDesc::CreateStructuredDesc(Stride, Count), BufferName);
	AddClearUAVPass(*Builder, Builder->CreateUAV(Made), 0u);
	return Made;
}

void FGaussianAvatarDevice::write(const avatar_unreal::BufferUse& Use, const void* Bytes, size_t Size)
{
	// A new buffer each time: the graph of the last frame may still read the old one.
	const uint32 Stride = sizeof(float);
	const FRDGBufferRef Made =
		CreateStructuredBuffer(*Builder, BufferName, Stride, static_cast<uint32>(Size) / Stride, Bytes, Size);
	Buffers[Use.id] = Builder->ConvertToExternalBuffer(Made);
}

void FGaussianAvatarDevice::run(
	const AvatarDispatch& Dispatch, const uint8_t* Block, const std::vector<avatar_unreal::Bound>& Bindings)
{
	FRDGBufferRef Bound[AvatarMostBindings] = {};
	for (const avatar_unreal::Bound& One : Bindings)
	{
		Bound[One.binding.binding] = Find(One.buffer, AvatarStride(One.binding.name));
	}
	AddAvatarPass(*Builder, Dispatch.entry, Block, Bound, Dispatch.groups);
}

void FGaussianAvatarDevice::release(uint32_t Owner)
{
	Buffers.erase(Buffers.lower_bound({Owner, 0}), Buffers.lower_bound({Owner + 1, 0}));
}
