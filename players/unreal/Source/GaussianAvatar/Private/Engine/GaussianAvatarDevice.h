#pragma once
#include <map>

#include "RenderGraphResources.h"
#include "unreal_scene.h"

class FRDGBuilder;

/** Runs the dispatches of a scene as passes of a render graph. Buffers outlive the graph. Render thread. */
class FGaussianAvatarDevice final : public avatar_unreal::Device
{
public:
	/** Takes the graph that the next calls add to, until End. */
	void Begin(FRDGBuilder& InBuilder) { Builder = &InBuilder; }
	void End() { Builder = nullptr; }

	/** The buffer in the graph, made if it is new or has grown. Stride: bytes of an element. */
	FRDGBufferRef Find(const avatar_unreal::BufferUse& Use, uint32 Stride);

	virtual void write(const avatar_unreal::BufferUse& Buffer, const void* Bytes, size_t Size) override;
	virtual void run(const AvatarDispatch& Dispatch, const uint8_t* Block, const std::vector<avatar_unreal::Bound>& Bindings) override;
	virtual void release(uint32_t Owner) override;

private:
	FRDGBufferRef Make(const avatar_unreal::BufferUse& Use, uint32 Stride);

	FRDGBuilder* Builder = nullptr;
	std::map<avatar_unreal::BufferId, TRefCountPtr<FRDGPooledBuffer>> Buffers;
};
