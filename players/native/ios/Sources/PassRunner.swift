import Metal

/// A struct of the player says how large it is.
protocol AvatarStruct {
    init()
    var struct_size: UInt32 { get set }
}

extension AvatarStruct {
    static var sized: Self {
        var made = Self()
        made.struct_size = UInt32(MemoryLayout<Self>.stride)
        return made
    }
}

extension AvatarFacts: AvatarStruct {}
extension AvatarClip: AvatarStruct {}
extension AvatarCamera: AvatarStruct {}
extension AvatarChunk: AvatarStruct {}
extension AvatarBuffer: AvatarStruct {}
extension AvatarDispatch: AvatarStruct {}
extension AvatarBinding: AvatarStruct {}
extension AvatarSceneChunk: AvatarStruct {}
extension AvatarSceneBuffer: AvatarStruct {}

/// The buffers of one avatar at one level, and its passes: mesh, deform, view, then the sort and the gather.
final class PassRunner {
    /// Quads in the order of drawing, and how many.
    let quads: MTLBuffer
    let count: Int

    private let device: MTLDevice
    private let pack: OpaquePointer
    private let lists: [OpaquePointer]  // AVATAR_MESH, AVATAR_DEFORM, AVATAR_VIEW
    private let sort: OpaquePointer
    private let buffers: [MTLBuffer]  // of the pack, by index
    private let sceneBuffers: [MTLBuffer]
    private let projected: [String: MTLBuffer]  // of the sort's chunks
    private var pipelines: [String: MTLComputePipelineState] = [:]
    private var kept = false

    /// Uploads everything.
    init(device: MTLDevice, pack: OpaquePointer, level: UInt32) throws {
        (self.device, self.pack) = (device, pack)
        buffers = try Self.packBuffers(device, pack)
        lists = try [AVATAR_MESH, AVATAR_DEFORM, AVATAR_VIEW].map { list -> OpaquePointer in
            let passes = avatar_passes_open(pack, level, UInt32(list), nil)
            guard let opened = passes, avatar_passes_error(opened) == nil else { throw AvatarFailure(avatar_passes_error(passes)) }
            return opened
        }
        let (sort, projected) = try Self.sort(pack, level, buffers)
        let sceneBuffers = try Self.sceneBuffers(device, sort)
        (self.sort, self.projected, self.sceneBuffers) = (sort, projected, sceneBuffers)
        let named = (0..<sceneBuffers.count).first { index in
            var buffer = AvatarSceneBuffer.sized
            return avatar_sort_buffer(sort, UInt32(index), &buffer) == AVATAR_OK && String(cString: buffer.name) == "Quads"
        }
        guard let at = named else { throw AvatarFailure(line: "the sort has no buffer Quads") }
        quads = sceneBuffers[at]
        count = Int(avatar_sort_count(sort))
        for passes: OpaquePointer? in lists + [avatar_sort_passes(sort)!] {
            var dispatch = AvatarDispatch.sized
            for index in 0..<avatar_passes_count(passes) where avatar_dispatch(passes, index, &dispatch) == AVATAR_OK {
                try makePipeline(dispatch.entry)
            }
        }
    }

    /// Encodes all passes of a frame, whose pose and camera the instance has.
    func run(in commands: MTLCommandBuffer, instance: OpaquePointer) {
        var floats: UInt32 = 0
        let index = avatar_buffer_index(pack, "Pose")
        if let pose = avatar_pose_floats(instance, &floats), index >= 0, floats > 0 {
            buffers[Int(index)].contents().copyMemory(from: pose, byteCount: Int(floats) * MemoryLayout<Float>.stride)
        }
        // One encoder: its dispatches run one after the other, and each sees what the last one wrote.
        guard let encoder = commands.makeComputeCommandEncoder() else { return }
        for passes in lists {
            avatar_passes_set(passes, instance)
            encode(passes, encoder)
        }
        if !kept { avatar_passes_keep_lasting(lists[Int(AVATAR_DEFORM)]) }
        kept = true
        encode(avatar_sort_passes(sort), encoder)
        encoder.endEncoding()
    }

    private func encode(_ passes: OpaquePointer?, _ encoder: MTLComputeCommandEncoder) {
        var bytes = 0
        guard let blocks = avatar_passes_blocks(passes, &bytes) else { return }
        var dispatch = AvatarDispatch.sized, binding = AvatarBinding.sized
        for index in 0..<avatar_passes_count(passes) where avatar_dispatch(passes, index, &dispatch) == AVATAR_OK {
            let entry = String(cString: dispatch.entry)
            guard let pipeline = pipelines[entry] else { continue }
            encoder.setComputePipelineState(pipeline)
            for at in 0..<dispatch.binding_count where avatar_binding(passes, index, at, &binding) == AVATAR_OK {
                encoder.setBuffer(buffer(binding, passes), offset: 0, index: Int(binding.binding))
            }
            encoder.setBytes(blocks + Int(dispatch.block_offset), length: Int(dispatch.block_bytes), index: Int(dispatch.block_binding))
            encoder.dispatchThreadgroups(
                MTLSize(width: Int(dispatch.groups), height: 1, depth: 1),
                threadsPerThreadgroup: MTLSize(width: Int(dispatch.threads), height: 1, depth: 1))
        }
    }

    private func buffer(_ binding: AvatarBinding, _ passes: OpaquePointer?) -> MTLBuffer? {
        if binding.index < 0 { return projected[String(cString: binding.buffer)] }
        return passes == avatar_sort_passes(sort) ? sceneBuffers[Int(binding.index)] : buffers[Int(binding.index)]
    }

    private func makePipeline(_ name: UnsafePointer<CChar>) throws {
        let entry = String(cString: name)
        if pipelines[entry] != nil { return }
        pipelines[entry] = try device.makeComputePipelineState(function: shaderFunction(device, entry))
    }

    private static func packBuffers(_ device: MTLDevice, _ pack: OpaquePointer) throws -> [MTLBuffer] {
        var facts = AvatarFacts.sized
        avatar_facts(pack, &facts)
        return try (0..<facts.buffers).map { index in
            var declared = AvatarBuffer.sized
            avatar_buffer(pack, index, &declared)
            let made = try zeros(device, Int(declared.bytes))
            if declared.has_content != 0 { avatar_buffer_content(pack, index, made.contents()) }
            return made
        }
    }

    private static func sceneBuffers(_ device: MTLDevice, _ sort: OpaquePointer) throws -> [MTLBuffer] {
        var made: [MTLBuffer] = []
        var declared = AvatarSceneBuffer.sized
        while avatar_sort_buffer(sort, UInt32(made.count), &declared) == AVATAR_OK {
            made.append(try zeros(device, Int(declared.stride) * Int(declared.count)))
        }
        return made
    }

    private static func sort(_ pack: OpaquePointer, _ level: UInt32, _ buffers: [MTLBuffer]) throws -> (OpaquePointer, [String: MTLBuffer]) {
        var chunks: [AvatarSceneChunk] = [], projected: [String: MTLBuffer] = [:]
        var chunk = AvatarChunk.sized
        while avatar_chunk(pack, level, UInt32(chunks.count), &chunk) == AVATAR_OK {
            let name = "0/\(chunks.count)"
            projected[name] = buffers[Int(chunk.projected)]
            var own = AvatarSceneChunk.sized
            own.buffer = UnsafePointer(strdup(name))
            own.count = chunk.count
            chunks.append(own)
        }
        defer { for one in chunks { free(UnsafeMutablePointer(mutating: one.buffer)) } }
        let opened = avatar_sort_open(chunks, UInt32(chunks.count), nil)
        guard let sort = opened, avatar_sort_error(sort) == nil else { throw AvatarFailure(avatar_sort_error(opened)) }
        return (sort, projected)
    }

    private static func zeros(_ device: MTLDevice, _ bytes: Int) throws -> MTLBuffer {
        // Metal gives new buffers zeros.
        guard let made = device.makeBuffer(length: max(bytes, 16), options: .storageModeShared) else {
            throw AvatarFailure(line: "the GPU has no memory for a buffer of \(bytes) bytes")
        }
        return made
    }
}

/// The function of an entry: its text is compiled on the device.
func shaderFunction(_ device: MTLDevice, _ entry: String) throws -> MTLFunction {
    guard let text = avatar_shader(UInt32(AVATAR_MSL), entry) else { throw AvatarFailure(line: "there is no shader \(entry)") }
    let options = MTLCompileOptions()
    options.fastMathEnabled = false  // as elsewhere: tolerances of the stages do not know fast maths
    let library = try device.makeLibrary(source: String(cString: text), options: options)
    guard let function = library.makeFunction(name: entry) else { throw AvatarFailure(line: "\(entry) has no function of its name") }
    return function
}
