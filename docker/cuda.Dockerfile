# e2efly on an NVIDIA GPU: the CUDA libraries come with JAX's packages, the driver with the host. From the root of the repository:
#   docker build -f docker/cuda.Dockerfile -t e2efly:cuda .
#   docker run --rm --gpus all -v "$PWD/runs:/data/runs" e2efly:cuda train hover --device gpu
FROM python:3.11-slim

# gcc builds the real firmware, once, at the first `e2efly firmware`
RUN apt-get update && apt-get install -y --no-install-recommends gcc g++ make && rm -rf /var/lib/apt/lists/*

WORKDIR /opt/e2efly
COPY pyproject.toml setup.py constraints.txt README.md LICENSE ./
COPY src ./src
RUN pip install --no-cache-dir -c constraints.txt '.[mesh-cuda,mujoco]'

# what the container runtime of NVIDIA reads
ENV NVIDIA_VISIBLE_DEVICES=all NVIDIA_DRIVER_CAPABILITIES=compute,utility

RUN useradd --create-home pilot && mkdir /data && chown pilot /data
USER pilot
WORKDIR /data
ENTRYPOINT ["e2efly"]
CMD ["--help"]
