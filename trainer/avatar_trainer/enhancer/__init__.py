"""The image-space enhancer: the network in torch, and as an ONNX file."""
