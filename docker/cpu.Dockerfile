# e2efly on the CPU. From the root of the repository:
#   docker build -f docker/cpu.Dockerfile -t e2efly .
#   docker run --rm -v "$PWD/runs:/data/runs" e2efly train hover
FROM python:3.11-slim

# gcc builds the real firmware, once, at the first `e2efly firmware`
RUN apt-get update && apt-get install -y --no-install-recommends gcc g++ make && rm -rf /var/lib/apt/lists/*

WORKDIR /opt/e2efly
COPY pyproject.toml setup.py constraints.txt README.md LICENSE ./
COPY src ./src
RUN pip install --no-cache-dir -c constraints.txt '.[mesh,mujoco]'

RUN useradd --create-home pilot && mkdir /data && chown pilot /data
USER pilot
WORKDIR /data
ENTRYPOINT ["e2efly"]
CMD ["--help"]
