"""An S3-compatible store for tests, with the bucket `lab`: prints its address, then lasts until its input ends."""

import sys

import boto3
from moto.server import ThreadedMotoServer

if __name__ == "__main__":
    server = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    address = f"http://{host}:{port}"
    client = boto3.client(
        "s3", endpoint_url=address, region_name="us-east-1", aws_access_key_id="test", aws_secret_access_key="test"
    )
    client.create_bucket(Bucket="lab")
    print(address, flush=True)
    # Each line replaces an object: its key, a space, its new content.
    for line in sys.stdin:
        key, content = line.rstrip("\n").split(" ", 1)
        client.put_object(Bucket="lab", Key=key, Body=content.encode())
        print("done", flush=True)
    server.stop()
