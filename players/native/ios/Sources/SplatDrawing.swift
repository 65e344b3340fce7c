import Metal

/// Blends quads in an image of half floats, then puts that image on the screen.
final class SplatDrawing {
    static let screenFormat = MTLPixelFormat.bgra8Unorm
    private static let imageFormat = MTLPixelFormat.rgba16Float  // every Apple GPU blends it
    private static let constants = 8  // the buffer of the texts' constants

    /// As the texts lay it out: RasterConstants.
    private struct RasterConstants {
        var imageSize: SIMD2<Float>
        var flipY: Float
        var unused: Float = 0
    }

    /// CompositeConstants.
    private struct CompositeConstants {
        var background: SIMD4<Float>
        var linearTarget: Float = 0
        var flipRows: Float = 0
        var imageSize: SIMD2<Float>
    }

    private let device: MTLDevice
    private let quads: MTLRenderPipelineState
    private let composite: MTLRenderPipelineState
    private var image: MTLTexture?

    init(device: MTLDevice) throws {
        self.device = device
        quads = try Self.quadPipeline(device)
        composite = try Self.compositePipeline(device)
    }

    /// Draws `count` quads over a dark background.
    func draw(_ instances: MTLBuffer, count: Int, in commands: MTLCommandBuffer, into target: MTLTexture) {
        guard let image = self.image(width: target.width, height: target.height) else { return }
        let size = SIMD2(Float(target.width), Float(target.height))
        if let encoder = commands.makeRenderCommandEncoder(descriptor: Self.pass(image)) {
            var raster = RasterConstants(imageSize: size, flipY: 1)
            encoder.setRenderPipelineState(quads)
            encoder.setVertexBuffer(instances, offset: 0, index: 0)
            encoder.setVertexBytes(&raster, length: MemoryLayout<RasterConstants>.stride, index: Self.constants)
            if count > 0 { encoder.drawPrimitives(type: .triangleStrip, vertexStart: 0, vertexCount: 4, instanceCount: count) }
            encoder.endEncoding()
        }
        if let encoder = commands.makeRenderCommandEncoder(descriptor: Self.pass(target)) {
            var values = CompositeConstants(background: SIMD4(0.1, 0.1, 0.1, 1), imageSize: size)
            encoder.setRenderPipelineState(composite)
            encoder.setFragmentTexture(image, index: 0)
            encoder.setFragmentBytes(&values, length: MemoryLayout<CompositeConstants>.stride, index: Self.constants)
            encoder.drawPrimitives(type: .triangle, vertexStart: 0, vertexCount: 3)
            encoder.endEncoding()
        }
    }

    private func image(width: Int, height: Int) -> MTLTexture? {
        if image?.width != width || image?.height != height {
            let descriptor = MTLTextureDescriptor.texture2DDescriptor(
                pixelFormat: Self.imageFormat, width: width, height: height, mipmapped: false)
            descriptor.usage = [.renderTarget, .shaderRead]
            descriptor.storageMode = .private
            image = device.makeTexture(descriptor: descriptor)
        }
        return image
    }

    private static func pass(_ texture: MTLTexture) -> MTLRenderPassDescriptor {
        let descriptor = MTLRenderPassDescriptor()
        descriptor.colorAttachments[0].texture = texture
        descriptor.colorAttachments[0].loadAction = .clear
        descriptor.colorAttachments[0].storeAction = .store
        descriptor.colorAttachments[0].clearColor = MTLClearColor(red: 0, green: 0, blue: 0, alpha: 0)
        return descriptor
    }

    private static func quadPipeline(_ device: MTLDevice) throws -> MTLRenderPipelineState {
        let descriptor = MTLRenderPipelineDescriptor()
        descriptor.vertexFunction = try shaderFunction(device, "raster_vertex")
        descriptor.fragmentFunction = try shaderFunction(device, "raster_pixel")
        let layout = MTLVertexDescriptor()
        for attribute in 0..<3 {  // quad0, quad1, quad2
            layout.attributes[attribute].format = .float4
            layout.attributes[attribute].offset = 16 * attribute
            layout.attributes[attribute].bufferIndex = 0
        }
        layout.layouts[0].stride = 48
        layout.layouts[0].stepFunction = .perInstance
        descriptor.vertexDescriptor = layout
        let colour = descriptor.colorAttachments[0]!
        colour.pixelFormat = imageFormat
        colour.isBlendingEnabled = true
        colour.sourceRGBBlendFactor = .one
        colour.sourceAlphaBlendFactor = .one
        colour.destinationRGBBlendFactor = .oneMinusSourceAlpha
        colour.destinationAlphaBlendFactor = .oneMinusSourceAlpha
        return try device.makeRenderPipelineState(descriptor: descriptor)
    }

    private static func compositePipeline(_ device: MTLDevice) throws -> MTLRenderPipelineState {
        let descriptor = MTLRenderPipelineDescriptor()
        descriptor.vertexFunction = try shaderFunction(device, "composite_vertex")
        descriptor.fragmentFunction = try shaderFunction(device, "composite_pixel")
        descriptor.colorAttachments[0].pixelFormat = screenFormat
        return try device.makeRenderPipelineState(descriptor: descriptor)
    }
}
